"""Tests of the C header: compiled with strict warnings as C and C++, and compared with RegisterBank."""

import ctypes
import math
import re
import subprocess

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneuforce.registers.codes import STATUS
from pneuforce.registers.document_text import ENUMERATIONS, TEST_BLOCK
from pneuforce.registers.map import BLOCKS, BY_NAME, REGISTERS
from pneuforce.registers.modbus.register_bank import RegisterBank
from pneuforce.registers.views import c_header
from tests.tools import needs

pytestmark = needs("gcc")
HEADER = c_header.render()
STRICT = ["-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wsign-conversion", "-Wshadow", "-Werror"]
#: With these compiler flags, undefined behaviour ends the process.
SANITIZER_FLAGS = ["-fsanitize=undefined", "-fsanitize-undefined-trap-on-error"]
FUNCTION = re.compile(
    r"^/\* (\d+): .* \*/\nstatic inline bool (\w+)\(const uint16_t \*from_(\d+)(.*), (\w+) \*value\)",
    re.MULTILINE,
)
FUNCTIONS = [(int(address), name, int(start), bool(order), type_)
             for address, name, start, order, type_ in FUNCTION.findall(HEADER)]  # fmt: skip
word = st.integers(0, 0xFFFF) | st.sampled_from([0, 0x7FFF, 0x8000, 0xFFFF, 0x7F80, 0xFF80, 0x7FC0])


def wrappers():
    """Yield the lines of a C file with a wrapper for each function. All wrappers have the same signature."""
    yield '#include "pneuforce_registers.h"\n'
    for address, name, _, order, type_ in FUNCTIONS:
        swapped = "swapped, " if order else ""
        unused = "" if order else "(void)swapped; "
        yield f"bool call_{address}(const uint16_t *words, bool swapped, double *value) {{\n"
        yield f"    {type_} result; bool valid; {unused}valid = {name}(words, {swapped}&result);\n"
        yield "    *value = (double)result; return valid;\n}\n"
    yield "bool order(const uint16_t *words, bool *swapped) {\n"
    yield "    return pneuforce_word_order(words, swapped);\n}\n"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("header")
    (folder / "pneuforce_registers.h").write_text(HEADER)
    (folder / "wrappers.c").write_text("".join(wrappers()))
    return folder


@pytest.fixture(scope="module")
def compiled(folder):
    built = folder / "wrappers.so"
    command = [
        "gcc",
        "-std=c99",
        *STRICT,
        *SANITIZER_FLAGS,
        "-O1",
        "-shared",
        "-fPIC",
        folder / "wrappers.c",
        "-o",
        built,
    ]
    subprocess.run(command, check=True)
    library = ctypes.CDLL(str(built))
    for function in (library.order, *(getattr(library, f"call_{address}") for address, *_ in FUNCTIONS)):
        function.restype = ctypes.c_bool
    return library


LANGUAGES = [
    *(pytest.param("gcc", "c", standard) for standard in ("c99", "c17")),
    *(pytest.param("g++", "c++", standard, marks=needs("g++")) for standard in ("c++11", "c++17")),
]


@pytest.mark.parametrize(("compiler", "language", "standard"), LANGUAGES)
def test_the_header_compiles_without_warnings_in_each_language(folder, compiler, language, standard):
    program = folder / "main.c"
    program.write_text('#include "pneuforce_registers.h"\nint main(void) { return 0; }\n')
    command = [compiler, "-x", language, f"-std={standard}", *STRICT, "-fsyntax-only", program]
    subprocess.run(command, check=True)


def test_each_register_has_its_function():
    assert [address for address, *_ in FUNCTIONS] == [register.address for register in REGISTERS]


@given(words=st.lists(word, min_size=128, max_size=128), swapped=st.booleans())
def test_each_function_decodes_the_same_value_as_the_register_bank(compiled, words, swapped):
    bank = RegisterBank(word_swap=swapped)
    data = b"".join(w.to_bytes(2, "big") for w in words)
    array = (ctypes.c_uint16 * len(words))(*words)
    value = ctypes.c_double()
    for (address, _, start, *_), register in zip(FUNCTIONS, REGISTERS, strict=True):
        (code,) = bank.decode_words([register], start, data)
        valid = getattr(compiled, f"call_{address}")(array, swapped, ctypes.byref(value))
        if register.wire.min_code is None:
            assert valid == math.isfinite(code), register.name
        else:
            assert valid == (code != register.not_available), register.name
        assert value.value == (code if valid else 0), register.name


def order_of(compiled, words):
    swapped = ctypes.c_bool()
    known = compiled.order((ctypes.c_uint16 * len(words))(*words), ctypes.byref(swapped))
    return known, swapped.value


@pytest.mark.parametrize("swapped", [False, True])
def test_the_test_registers_show_the_word_order(compiled, swapped):
    bank = RegisterBank(word_swap=swapped)
    data = b"".join(bank.encode_words(r, r.constant) for r in REGISTERS if r.address in TEST_BLOCK)
    words = [int.from_bytes(data[at : at + 2], "big") for at in range(0, len(data), 2)]
    assert order_of(compiled, words) == (True, swapped)
    for at in range(len(words)):
        other = [w ^ (i == at) for i, w in enumerate(words)]
        assert not order_of(compiled, other)[0]


def defined_numbers(folder):
    """Return the name of each macro and enumerator, with the number that the compiler computes."""
    names = re.findall(r"^#define (PNEUFORCE_\w+) |^    (PNEUFORCE_\w+) = ", HEADER, re.MULTILINE)
    names = [macro or enumerator for macro, enumerator in names if not macro.endswith("REGISTERS_H")]
    lines = "".join(f'printf("{name} %.9g\\n", (double)({name}));\n' for name in names)
    (folder / "print.c").write_text(
        f'#include <stdio.h>\n#include "pneuforce_registers.h"\nint main(void) {{ {lines} return 0; }}\n'
    )
    subprocess.run(["gcc", "-std=c99", folder / "print.c", "-o", folder / "print"], check=True)
    output = subprocess.run([folder / "print"], capture_output=True, text=True, check=True).stdout
    return {name: float(number) for name, number in map(str.split, output.splitlines())}


def test_every_number_agrees_with_the_map(folder):
    numbers = defined_numbers(folder)
    for register in REGISTERS:
        assert numbers[f"PNEUFORCE_ADDRESS_{register.name.upper()}"] == register.address
    for bit in STATUS.bits:
        assert numbers[f"PNEUFORCE_STATUS_{bit.name.upper()}"] == pytest.approx(1 << bit.number)
    for name, values in ENUMERATIONS.items():
        for code, value in values.names.items():
            assert numbers[f"PNEUFORCE_{name.replace(' ', '_').upper()}_{value.upper()}"] == code
    assert numbers["PNEUFORCE_MIN_FORCE_LIMIT"] == pytest.approx(BY_NAME["force_limit"].low)
    assert numbers["PNEUFORCE_MAX_LEASE"] == BY_NAME["lease"].high
    assert [start for start, _ in BLOCKS if f"from_{start}" not in HEADER] == []
