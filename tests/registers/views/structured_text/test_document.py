"""Tests of the Structured Text without a PLC: the text parses, and uses only common language elements."""

import re

import pytest

from pneuforce.registers.document_text import ENUMERATIONS
from pneuforce.registers.map import REGISTERS
from tests.registers.views.structured_text.compiled import MARKS, iec2c
from tests.registers.views.structured_text.parsing import tree_of
from tests.registers.views.structured_text.sources import (
    BLOCKS,
    CONSTANTS,
    EXTENDED_PROGRAM,
    LIBRARY,
    PROGRAM,
    SOURCE,
    members,
    members_of,
)

#: Keywords, types, functions and blocks of IEC 61131-3 that have the same meaning on each PLC.
COMMON = set(
    re.findall(
        r"\w+",
        """
        FUNCTION_BLOCK END_FUNCTION_BLOCK VAR_INPUT VAR_OUTPUT VAR CONSTANT END_VAR TRUE FALSE AND OR NOT
        IF THEN ELSIF ELSE END_IF WHILE DO END_WHILE BOOL INT DINT UINT WORD DWORD REAL TIME
        SHL SHR WORD_TO_DWORD WORD_TO_INT WORD_TO_DINT WORD_TO_UINT UINT_TO_WORD INT_TO_WORD REAL_TO_INT
        DINT_TO_REAL UINT_TO_INT TON IN PT Q ET
        """,
    )
)
NAME = re.compile(r"(?<![\w#])[A-Za-z_]\w*")
each_block = pytest.mark.parametrize("block", re.findall(r"^FUNCTION_BLOCK (\w+)$", LIBRARY, re.MULTILINE))


def without_comments(text):
    """Return `text` without comments and typed literals."""
    return re.sub(r"\(\*.*?\*\)|\w+#[\w#]+", " ", text, flags=re.DOTALL)


def text_of(block):
    return re.search(rf"^FUNCTION_BLOCK {block}\n.*?^END_FUNCTION_BLOCK\n", LIBRARY, re.M | re.S)[0]


@pytest.mark.parametrize(
    "text",
    re.split(r"\n(?=VAR_GLOBAL|TYPE|FUNCTION_BLOCK)", SOURCE) + [PROGRAM, EXTENDED_PROGRAM],
    ids=lambda text: " ".join(text.split()[:2]),
)
def test_blark_parses_the_text(text):
    assert tree_of(text) is not None


@each_block
def test_a_block_uses_only_its_declarations_and_common_names(block):
    structures = [("TYPE", f"PF_{name}") for name in ("VALUES", "STATUS", "DIAGNOSTIC_VALUES")]
    declared = {name for kind in [("FUNCTION_BLOCK", block), *structures] for name, _ in members(*kind)}
    inputs = {name for other in BLOCKS for name, _ in members_of(other)}
    types = set(re.findall(r"PF_\w+", SOURCE))
    assert set(NAME.findall(without_comments(text_of(block)))) - declared - inputs - types - COMMON == set()


def test_names_are_unique_without_regard_to_case():
    names = [name.upper() for name in re.findall(r"^    (\w+) : ", CONSTANTS, re.MULTILINE)]
    names += [name.upper() for name in re.findall(r"^(?:TYPE|FUNCTION_BLOCK) (\w+)", LIBRARY, re.MULTILINE)]
    assert len(names) == len(set(names)) > len(REGISTERS)
    for block in BLOCKS:
        block_names = [name.upper() for name, _ in members_of(block)]
        assert len(block_names) == len(set(block_names))


def test_every_register_and_code_is_a_constant():
    for register in REGISTERS:
        assert f" PF_ADDRESS_{register.name.upper()} : UINT := {register.address};" in CONSTANTS
    for values in ENUMERATIONS.values():
        for code, name in values.names.items():
            assert re.search(rf" PF_\w+_{name.upper()} : UINT := {code};", CONSTANTS)


def test_each_constant_fits_its_type():
    limits = {"UINT": (0, 0xFFFF), "INT": (-0x8000, 0x7FFF)}
    found = re.findall(r"^    (\w+) : (U?INT) := (-?\d+);", CONSTANTS, re.MULTILINE)
    assert ("PF_MIN_REFERENCE_PRESSURE_PA", "INT", "-1000") in found
    assert [c for c in found if not limits[c[1]][0] <= int(c[2]) <= limits[c[1]][1]] == []


def test_the_text_is_ascii_without_pragmas():
    assert SOURCE.isascii()
    assert not re.search(r"__|\{|\$", SOURCE)  # identifiers without a double underscore, and no pragmas


@pytest.mark.parametrize("compile_", [pytest.param(iec2c, marks=MARKS)])
def test_the_constants_compile_in_a_configuration(compile_, tmp_path):
    globals_ = CONSTANTS[CONSTANTS.index("VAR_GLOBAL") :] + "END_VAR"
    program = "PROGRAM main VAR a : BOOL; END_VAR a := NOT a; END_PROGRAM"
    task = "TASK t(INTERVAL := T#10ms, PRIORITY := 0); PROGRAM p WITH t : main;"
    resource = f"RESOURCE r ON PLC {task} END_RESOURCE"
    compile_(f"{program}\nCONFIGURATION c\n{globals_}\n{resource}\nEND_CONFIGURATION\n", tmp_path)
