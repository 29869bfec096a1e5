"""Requests to write that never reach the source: it hears of them, for whoever keeps a log."""

import pytest

from tests.registers.modbus.asking import PLC, answer
from tests.registers.modbus.memory import MemorySource


@pytest.mark.parametrize(
    ("request_", "why"),
    [
        ("10 0200 0002 04 7fc00000", "illegal_value"),  # NaN
        ("10 0200 0002 04 41400001", "illegal_value"),  # just above 12 kPa
        ("06 0200 4100", "illegal_value"),  # half of a float
        ("06 0000 0001", "illegal_address"),
        ("05 0000 ff00", "illegal_address"),
        ("10 0200 0002 05 4100000000", "illegal_value"),
        ("10", "illegal_value"),
    ],
)
def test_a_write_that_is_refused_before_the_source_is_told_to_it_with_its_bytes(request_, why):
    source = MemorySource()
    answer(request_, source)
    assert source.turned_away == [(PLC, bytes.fromhex(request_), why)]
    assert source.asked == []


def test_what_the_source_itself_refused_is_not_told_again():
    source = MemorySource(refuse=lambda peer, values: "lease")
    answer("06 0204 0001", source)
    assert source.turned_away == []


def test_of_a_read_only_face_each_write_but_a_vent_is_told():
    source = MemorySource()
    for request in ("06 0204 0001", "06 0204 0000"):
        answer(request, source, read_only=True)
    assert [why for _, _, why in source.turned_away] == ["illegal_function"]


@pytest.mark.parametrize("request_", ["03 ffff 0001", "04 0000 0000", "64 00", "08 0001 0000"])
def test_what_is_no_write_is_not_told(request_):
    source = MemorySource()
    answer(request_, source)
    assert source.turned_away == []
