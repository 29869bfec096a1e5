"""Function blocks compiled with matiec and gcc, and called with ctypes in virtual time."""

import ctypes
import re
import shutil
import subprocess
import tempfile
from functools import cache
from pathlib import Path

import pytest

from pneuforce.registers.views import structured_text
from tests.tools import needs

MATIEC = shutil.which("iec2c")
#: matiec is not a Debian package. The tests run if iec2c is on the PATH, with its lib folder next to it.
PYTESTMARKS = [
    pytest.mark.skipif(not MATIEC, reason="iec2c is missing: matiec compiles the Structured Text"),
    needs("gcc"),
]
SOURCE = structured_text.render()
CONSTANTS, LIBRARY = SOURCE.split("END_VAR\n", 1)
GUIDE = (Path(__file__).parents[4] / "docs/plc.md").read_text(encoding="utf-8")
[PROGRAM] = re.findall(r"```iecst\n(.*?)```", GUIDE, re.DOTALL)
BLOCKS = re.findall(r"^(?:FUNCTION_BLOCK|PROGRAM) (\w+)$", LIBRARY + PROGRAM, re.MULTILINE)
_VARIABLE = re.compile(r"^    (\w+) : (\w+)(?: := [^;]*)?;", re.MULTILINE)
_NUMBERS = {"BOOL", "INT", "UINT", "DINT", "WORD", "DWORD", "REAL"}
_HARNESS = """\
#include "iec_std_lib.h"
TIME __CURRENT_TIME;
BOOL __DEBUG;
#include "POUS.h"
#include "POUS.c"
{blocks}
void at(double now_s) {{
    __CURRENT_TIME.tv_sec = (long)now_s;
    __CURRENT_TIME.tv_nsec = (long)((now_s - (long)now_s) * 1e9);
}}
void new(int block) {{ switch (block) {{ {new} }} }}
void cycle(int block) {{ switch (block) {{ {cycle} }} }}
double get(int variable) {{ switch (variable) {{ {get} }} return 0; }}
void set(int variable, double value) {{ switch (variable) {{ {set} }} }}
void word(int array, int at, int value) {{ switch (array) {{ {word} }} }}
"""


def iec2c(source, folder):
    """Compile `source` to C files in `folder`. Return the folder of the C headers of matiec."""
    file = Path(folder) / "source.st"
    file.write_text(source)
    library = Path(MATIEC).resolve().parent / "lib"
    done = subprocess.run(
        [MATIEC, "-f", "-I", library, "-T", folder, file], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return library / "C"


def members(kind, name):
    """Return the name and type of each variable of a block or structure."""
    text = re.search(rf"^{kind} {name}\b(.*?)^END_{kind}", LIBRARY + PROGRAM, re.MULTILINE | re.DOTALL)
    return _VARIABLE.findall(text[1])


def members_of(block):
    """Return the name and type of each variable of a function block or of the program in the guide."""
    return members("PROGRAM" if f"PROGRAM {block}\n" in PROGRAM else "FUNCTION_BLOCK", block)


@cache
def variables():
    """Return a dictionary from (block, variable name) to the C expression of each numeric variable."""
    found = {}
    for block in BLOCKS:
        for name, type_ in members_of(block):
            if type_ in _NUMBERS:
                found[block, name] = f"{block}_.{name.upper()}.value"
            elif type_ in ("PF_VALUES", "PF_STATUS"):
                for inner, _ in members("TYPE", type_):
                    found[block, f"{name}.{inner}"] = f"{block}_.{name.upper()}.value.{inner.upper()}"
    return found


@cache
def arrays():
    """Return the block and the name of each array of words."""
    return [
        (block, name) for block in BLOCKS for name, type_ in members_of(block) if type_.endswith("_WORDS")
    ]


@cache
def library():
    """Return the compiled library, which is built once per test run."""
    numbered = list(enumerate(variables().values()))
    cases = {
        "blocks": "\n".join(f"static {block.upper()} {block}_;" for block in BLOCKS),
        "new": "".join(f"case {i}: {b.upper()}_init__(&{b}_, 0); break; " for i, b in enumerate(BLOCKS)),
        "cycle": "".join(f"case {i}: {b.upper()}_body__(&{b}_); break; " for i, b in enumerate(BLOCKS)),
        "get": "".join(f"case {i}: return (double){path};\n" for i, path in numbered),
        "set": "".join(f"case {i}: {path} = value; break;\n" for i, path in numbered),
        "word": "".join(
            f"case {i}: {block}_.{name.upper()}.value.table[at] = (WORD)value; break; "
            for i, (block, name) in enumerate(arrays())
        ),
    }
    with tempfile.TemporaryDirectory() as folder:
        include = iec2c(LIBRARY + PROGRAM, folder)
        (Path(folder) / "harness.c").write_text(_HARNESS.format(**cases))
        built = Path(folder) / "blocks.so"
        subprocess.run(
            ["gcc", "-std=gnu99", "-w", "-O1", "-I", include, "-I", folder, "-shared", "-fPIC", "-o", built]
            + [Path(folder) / "harness.c", "-lm"],
            check=True,
        )
        loaded = ctypes.CDLL(str(built))
    loaded.get.restype = ctypes.c_double
    return loaded


class Block:
    """The single instance of a function block or of the program: a mapping from names to values."""

    def __init__(self, name):
        self._c = library()
        self._name = name
        self._number = BLOCKS.index(name)
        self._variables = {variable: i for i, (block, variable) in enumerate(variables()) if block == name}
        self._c.new(self._number)

    def __getitem__(self, name):
        return self._c.get(self._variables[name])

    def __setitem__(self, name, value):
        self._c.set(self._variables[name], ctypes.c_double(value))

    def words(self, words, array="Words"):
        number = arrays().index((self._name, array))
        for at, word in enumerate(words):
            self._c.word(number, at, word)

    def cycle(self, now_s=0.0, **inputs):
        self._c.at(ctypes.c_double(now_s))
        for name, value in inputs.items():
            self[name] = value
        self._c.cycle(self._number)
        return self
