"""Tests of rejected write requests: the source receives them for its log."""

import pytest

from tests.registers.modbus.memory_source import MemorySource
from tests.registers.modbus.pdu_requests import PLC, answer


@pytest.mark.parametrize(
    ("request_", "reason"),
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
def test_a_rejected_write_is_logged_with_its_bytes(request_, reason):
    source = MemorySource()
    answer(request_, source)
    assert source.rejected_writes == [(PLC, bytes.fromhex(request_), reason)]
    assert source.write_requests == []


def test_a_write_that_the_source_rejects_is_not_logged_again():
    source = MemorySource(reject=lambda peer, values: "lease")
    answer("06 0204 0001", source)
    assert source.rejected_writes == []


def test_a_read_only_server_logs_each_write_except_a_vent():
    source = MemorySource()
    for request in ("06 0204 0001", "06 0204 0000"):
        answer(request, source, read_only=True)
    assert [reason for _, _, reason in source.rejected_writes] == ["illegal_function"]


@pytest.mark.parametrize("request_", ["03 ffff 0001", "04 0000 0000", "64 00", "08 0001 0000"])
def test_rejected_reads_are_not_logged(request_):
    source = MemorySource()
    answer(request_, source)
    assert source.rejected_writes == []
