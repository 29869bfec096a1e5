"""Requests by name: what a Modbus client may write may be asked, and nothing else."""

import math

import pytest

from registers.asked import Malformed, asked
from registers.map import REGISTERS


@pytest.mark.parametrize("register", [r for r in REGISTERS if r.writable], ids=lambda r: r.name)
def test_the_ends_of_each_span_may_be_asked_and_what_lies_beyond_may_not(register):
    if register.low is None:
        return
    for value in (register.low, register.high):
        whole = value if register.wire.name == "F32" else int(value)
        assert asked({register.name: whole})[register.quantity] == register.decode(whole)
    for value in (register.low - 1, register.high + 1):
        with pytest.raises(Malformed, match=register.name):
            asked({register.name: value})


@pytest.mark.parametrize("register", [r for r in REGISTERS if not r.writable], ids=lambda r: r.name)
def test_what_is_read_only_may_not_be_asked(register):
    with pytest.raises(Malformed, match="no register that can be written"):
        asked({register.name: 1})


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("setpoint_requested", math.nan),
        ("setpoint_requested", math.inf),
        ("setpoint_requested", "8"),
        ("setpoint_requested", None),
        ("setpoint_requested", True),
        ("setpoint_requested", [8.0]),
        ("setpoint_requested", 10**400),
        ("mode", "inflate"),
        ("mode", 2),
        ("mode", 0.5),
        ("mode", -1),
        ("lease", 65536),
        ("command_argument", 65536),
        ("command_argument", -1),
        ("command_key", 20551),
        ("", 1),
        ("no_such", 1),
    ],
)
def test_values_that_are_none_are_refused_in_a_sentence(name, value):
    with pytest.raises(Malformed) as refusal:
        asked({name: value})
    assert len(str(refusal.value)) < 500


def test_codes_may_be_asked_by_name_and_by_number():
    assert asked({"mode": "hold"}) == asked({"mode": 1}) == {"mode": "hold"}
    assert asked({"lease": 0, "setpoint_requested": 8}) == {"lease_s": 0.0, "setpoint_requested_kpa": 8.0}


def test_nothing_is_no_request():
    with pytest.raises(Malformed):
        asked({})
