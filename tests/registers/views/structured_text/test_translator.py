"""Tests of the translator: each rule of IEC 61131-3 that it follows, and each program that it rejects."""

import math

import pytest

from tests.registers.views.structured_text.elementary import PlcError
from tests.registers.views.structured_text.parsing import declarations
from tests.registers.views.structured_text.standard_blocks import FallingEdge, OnDelay, RisingEdge
from tests.registers.views.structured_text.translator import translated

VARIABLES = """\
VAR_INPUT given : INT; END_VAR
VAR_OUTPUT i : INT; END_VAR
VAR d : DINT; u : UINT; w : WORD; dw : DWORD; r : REAL; b : BOOL; t : TIME; n : INT := -7;
    list : PF_LIST; timer : TON; END_VAR
VAR CONSTANT limit : INT := 3; END_VAR
"""
TYPES = "TYPE PF_LIST : ARRAY[1..3] OF WORD; END_TYPE\n"


def run(statements):
    """Run statements once. Return the instance with its variables."""
    text = f"{TYPES}FUNCTION_BLOCK T\n{VARIABLES}{statements}\nEND_FUNCTION_BLOCK\n"
    instance = translated(declarations(text))["T"].create()
    return instance.cycle(0)


@pytest.mark.parametrize(
    ("statements", "name", "value"),
    [
        ("i := 32767; i := i + 1;", "I", -32768),  # integers wrap around
        ("u := 0; u := u - 1;", "U", 65535),
        ("d := 2147483647; d := d * 2;", "D", -2),
        ("i := n / 2;", "I", -3),  # truncated towards zero
        ("i := n MOD 4;", "I", -3),
        ("r := 16777216.0; r := r + 1.0;", "R", 16777216.0),  # 32 bits
        ("r := 0.1; b := r = 0.1;", "B", True),  # the literal has 32 bits, too
        ("r := 3.4E38; r := r * 10.0;", "R", math.inf),
        ("i := REAL_TO_INT(2.5);", "I", 2),  # halves are rounded to the even number
        ("i := REAL_TO_INT(3.5);", "I", 4),
        ("w := WORD#16#8001; i := WORD_TO_INT(w);", "I", -32767),  # the bits are kept
        ("w := INT_TO_WORD(-1);", "W", 0xFFFF),
        ("dw := SHL(WORD_TO_DWORD(WORD#16#8000), 16);", "DW", 0x80000000),
        ("w := SHL(WORD#16#8001, 1);", "W", 2),
        ("w := SHR(WORD#16#8001, 1);", "W", 0x4000),
        ("w := NOT WORD#16#00FF;", "W", 0xFF00),
        ("b := NOT FALSE AND FALSE OR TRUE;", "B", True),  # NOT before AND before OR
        ("b := TRUE XOR TRUE OR TRUE;", "B", True),
        ("i := 2 + 3 * 4;", "I", 14),
        ("b := 1 + 1 = 2 AND 3 > 2;", "B", True),
        ("i := -n;", "I", 7),
        ("d := n;", "D", -7),  # to a wider type without a function
        ("r := n;", "R", -7.0),
        ("t := T#1s500ms;", "T", 1500),
        ("list[3] := WORD#7; w := list[3];", "W", 7),
        ("CASE n OF -7: i := 1; 0..5: i := 2; ELSE i := 3; END_CASE;", "I", 1),
        ("n := 5; CASE n OF -7: i := 1; 0..5: i := 2; ELSE i := 3; END_CASE;", "I", 2),
        ("n := 6; CASE n OF -7: i := 1; 0..5: i := 2; ELSE i := 3; END_CASE;", "I", 3),
        ("FOR n := 1 TO 5 DO i := i + n; END_FOR;", "I", 15),
        ("FOR n := 1 TO 5 DO i := n; END_FOR;", "N", 6),  # the variable passes the limit
        ("FOR n := 5 TO 1 BY -2 DO i := i * 10 + n; END_FOR;", "I", 531),
        ("FOR n := 1 TO 5 DO i := n; IF n = 3 THEN EXIT; END_IF; END_FOR;", "I", 3),
        ("FOR n := 1 TO 0 DO i := 9; END_FOR;", "I", 0),
        ("n := 0; WHILE n < limit DO n := n + 1; END_WHILE;", "N", 3),
        ("IF FALSE THEN i := 1; ELSIF TRUE THEN i := 2; ELSE i := 3; END_IF;", "I", 2),
        ("timer(IN := TRUE, PT := T#0s); b := timer.Q;", "B", True),
    ],
)
def test_a_statement_has_the_result_of_the_standard(statements, name, value):
    assert getattr(run(statements), name) == value


@pytest.mark.parametrize(
    "statements",
    [
        "i := u;",  # types that do not convert without a function
        "u := n;",
        "i := d;",
        "r := d;",
        "w := n;",
        "b := n;",
        "i := 2.0;",
        "b := n + w = 3;",
        "b := n AND 3;",
        "u := 65536;",
        "u := -1;",
        "w := WORD#16#10000;",
        "b := -w = 0;",
        "IF n THEN i := 1; END_IF;",
        "i := REAL_TO_INT(40000.0);",  # results that differ between PLCs
        "r := 1.0; r := r / 0.0; i := REAL_TO_INT(r);",
        "i := 1 / (n + 7);",
        "list[0] := WORD#1;",
        "WHILE TRUE DO i := 1; END_WHILE;",
        "limit := 4;",  # variables that the block may not write or does not have
        "given := 1;",
        "unknown := 1;",
        "timer.Q := TRUE;",
        "timer(Q := TRUE);",
        "i := timer.unknown;",
        "i := LEN('text');",
    ],
)
def test_a_program_that_some_plcs_reject_is_rejected(statements):
    with pytest.raises(PlcError):
        run(statements)


def test_a_block_keeps_its_state_and_names_have_no_case():
    instance = translated(
        declarations(f"{TYPES}FUNCTION_BLOCK T\n{VARIABLES}I := i + LIMIT;\nEND_FUNCTION_BLOCK")
    )
    block = instance["T"].create()
    assert [block.cycle(0).I for _ in range(3)] == [3, 6, 9]


def outputs(block, name, inputs, period_ms=10):
    """Return the output Q for each value of an input, with one cycle per value."""
    found = []
    for cycle, value in enumerate(inputs):
        setattr(block, name, value)
        block.cycle(cycle * period_ms)
        found.append(block.Q)
    return found


def test_a_timer_needs_its_input_without_interruption():
    timer = OnDelay()
    timer.PT = 30
    course = [1, 1, 1, 0, 1, 1, 1, 1, 1, 0]
    assert outputs(timer, "IN", map(bool, course)) == [n in (7, 8) for n in range(10)]


def test_an_edge_is_shown_for_one_cycle():
    course = [False, True, True, False, False, True]
    assert outputs(RisingEdge(), "CLK", course) == [False, True, False, False, False, True]
    assert outputs(FallingEdge(), "CLK", course) == [False, False, False, True, False, False]
