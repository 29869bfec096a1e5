"""Tests of the C++ header of the robot guide: setpoints out of range, and forces that must not be used."""

import subprocess
from pathlib import Path

import pytest

from pneuforce.registers.can.frames import COMMAND
from tests.registers.views.cpp_listener import compiled
from tests.tools import needs

SOURCE = Path(__file__).with_name("robot_header.cpp")
VALID_PA = {"2": 2000, "8.0": 8000, "12": 12000}
INVALID = ("8000", "73.5", "-1", "60", "nan", "inf", "1.9999", "12.0001", "0")
[SETPOINT] = (field for field in COMMAND.fields if field.name == "setpoint")


@pytest.fixture(scope="module")
def lines(tmp_path_factory):
    program = compiled(tmp_path_factory.mktemp("header"), SOURCE)
    arguments = [program, *VALID_PA, *INVALID]
    return subprocess.run(arguments, stdout=subprocess.PIPE, text=True, check=True).stdout.splitlines()


@needs("g++")
def test_a_hold_out_of_range_has_a_setpoint_that_the_instrument_rejects(lines):
    sent = {words[1]: words[2:] for words in map(str.split, lines) if words[0] == "hold"}
    expected = VALID_PA | dict.fromkeys(INVALID, 0xFFFF)
    assert sent == {setpoint: ["vent=0", f"hold={code}"] for setpoint, code in expected.items()}
    assert not SETPOINT.accepts(0xFFFF)
    assert all(SETPOINT.accepts(code) for code in VALID_PA.values())


@needs("g++")
def test_a_force_without_its_valid_bit_or_with_an_unknown_age_is_nan(lines):
    assert [line for line in lines if line.startswith("force")] == [
        "force zeros value=nan valid=0",
        "force new value=0.5 valid=1",
        "force old value=nan valid=0",
        "force future value=nan valid=0",
    ]


@needs("g++")
def test_a_fast_fall_of_the_force_is_reported_until_the_reference_has_followed(lines):
    assert [line for line in lines if line.startswith("fall")] == [f"fall falls={n}" for n in (0, 1, 0)]


@needs("g++")
def test_the_frames_of_another_node_have_its_identifiers(lines):
    assert lines[-1] == "node command=209 release=209 other=0"
