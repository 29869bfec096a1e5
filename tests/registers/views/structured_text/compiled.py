"""Function blocks compiled with matiec and gcc, and called with ctypes in virtual time."""

import ctypes
import shutil
import subprocess
import tempfile
from functools import cache
from pathlib import Path

import pytest

from tests.registers.views.structured_text.sources import TEXT, blocks_of, members, nested_members_of
from tests.tools import needs

MATIEC = shutil.which("iec2c")
#: matiec is not a Debian package. The tests run if iec2c is on the PATH, with its lib folder next to it.
MARKS = [
    pytest.mark.skipif(not MATIEC, reason="iec2c is missing: matiec compiles the Structured Text"),
    needs("gcc"),
]
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


@cache
def variables(text=TEXT):
    """Return a dictionary from (block, variable name) to the C expression of each numeric variable."""
    found = {}
    for block in blocks_of(text):
        for name, path, type_ in nested_members_of(block, text):
            if type_ in _NUMBERS:
                found[block, name] = f"{block}_.{path}.value"
            elif type_ in ("PF_VALUES", "PF_STATUS", "PF_DIAGNOSTIC_VALUES"):
                for inner, _ in members("TYPE", type_, text):
                    found[block, f"{name}.{inner}"] = f"{block}_.{path}.value.{inner.upper()}"
    return found


@cache
def arrays(text=TEXT):
    """Return a dictionary from (block, variable name) to the C expression of each array of words."""
    return {
        (block, name): f"{block}_.{path}.value.table"
        for block in blocks_of(text)
        for name, path, type_ in nested_members_of(block, text)
        if type_.endswith("_WORDS")
    }


@cache
def library(text=TEXT):
    """Return the compiled text, which is built once per test run."""
    numbered, names = list(enumerate(variables(text).values())), blocks_of(text)
    cases = {
        "blocks": "\n".join(f"static {block.upper()} {block}_;" for block in names),
        "new": "".join(f"case {i}: {b.upper()}_init__(&{b}_, 0); break; " for i, b in enumerate(names)),
        "cycle": "".join(f"case {i}: {b.upper()}_body__(&{b}_); break; " for i, b in enumerate(names)),
        "get": "".join(f"case {i}: return (double){path};\n" for i, path in numbered),
        "set": "".join(f"case {i}: {path} = value; break;\n" for i, path in numbered),
        "word": "".join(
            f"case {i}: {path}[at] = (WORD)value; break; " for i, path in enumerate(arrays(text).values())
        ),
    }
    with tempfile.TemporaryDirectory() as folder:
        include = iec2c(text, folder)
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


class CompiledBlock:
    """The single instance of a function block or of the program: a mapping from names to values."""

    def __init__(self, name, text=TEXT):
        self._c = library(text)
        self._number = blocks_of(text).index(name)
        self._variables = {at: i for i, (block, at) in enumerate(variables(text)) if block == name}
        self._arrays = {at: i for i, (block, at) in enumerate(arrays(text)) if block == name}
        self._c.new(self._number)

    def __getitem__(self, name):
        return self._c.get(self._variables[name])

    def __setitem__(self, name, value):
        self._c.set(self._variables[name], ctypes.c_double(value))

    def words(self, words, array="Words"):
        for at, word in enumerate(words):
            self._c.word(self._arrays[array], at, word)

    def cycle(self, now_s=0.0, **inputs):
        self._c.at(ctypes.c_double(now_s))
        for name, value in inputs.items():
            self[name] = value
        self._c.cycle(self._number)
        return self
