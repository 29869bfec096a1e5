"""Tests of the bus load limit: a master cannot configure a bus load above 60 %."""

import pytest

from pneuforce.registers.can.options import MAX_BUS_LOAD, CanOptions
from pneuforce.registers.can.wire import worst_case_bits
from pneuforce.registers.canopen.abort import AbortCode, SdoAbort
from pneuforce.registers.canopen.parameters import Parameters
from tests.registers.canopen.cases import OPERATIONAL
from tests.registers.canopen.fake_master import FakeMaster, frames_match

SLOW_BIT_RATE = 125_000
FORCE, STATUS = 0x1800, 0x1802
ALARM, CALM = frozenset({"holding", "force_high_alarm"}), frozenset({"holding"})
VALUE_ABORT = "585 80 {:02X} 18 {:02X} 30 00 09 06"


def abort_code_of(index, sub, value, before=(), bit_rate=SLOW_BIT_RATE):
    """Return the abort code for writing a parameter, or None if the write is accepted."""
    parameters = Parameters(CanOptions(bit_rate=bit_rate))
    for at, code in before:
        parameters.set(at, code)
    try:
        parameters.set((index, sub), value)
    except SdoAbort as abort:
        return abort.abort_code
    return None


@pytest.mark.parametrize(
    ("inhibit", "abort_code"),
    [
        (0, AbortCode.INVALID_VALUE),
        (10, AbortCode.INVALID_VALUE),
        (29, AbortCode.INVALID_VALUE),
        (30, None),
        (99, None),
    ],
)
def test_a_short_inhibit_time_of_status_counts_with_the_sample_rate(inhibit, abort_code):
    before = [((STATUS, 1), 0xC000_0385), ((STATUS, 3), inhibit)]
    assert (
        abort_code_of(STATUS, 1, 0x4000_0385, before) is abort_code
    )  # the bus has room for 341 frames per second
    assert abort_code_of(STATUS, 1, 0x4000_0385, before, bit_rate=500_000) is None


def bits_with_changing_status(master, seconds):
    """Return the number of bits that the node sends while its status changes with each sample."""
    bits = 0
    for step in range(round(seconds / 0.002)):
        master.now_s += 0.002
        master.source.set(status=ALARM if step % 2 else CALM)
        frames = master.node.on_sample(master.now_s)
        frames += master.node.tick(master.now_s) if step % 5 == 0 else []
        bits += sum(worst_case_bits(len(frame.data)) for frame in frames)
    return bits


@pytest.mark.parametrize("inhibit", [0, 10, 20, 30, 50, 99, 100])
def test_a_status_that_changes_with_each_sample_stays_below_the_limit(inhibit):
    master = FakeMaster(OPERATIONAL, bit_rate=SLOW_BIT_RATE)
    for step in (
        "605 23 02 18 01 85 03 00 C0",
        f"605 2B 02 18 03 {inhibit:02X}",
        "605 23 02 18 01 85 03 00 40",
    ):
        master.send(step)
    assert bits_with_changing_status(master, 2.0) / 2.0 / SLOW_BIT_RATE <= MAX_BUS_LOAD


def test_enabling_a_pdo_with_too_high_a_rate_is_rejected():
    master = FakeMaster(bit_rate=SLOW_BIT_RATE)
    for step in ("605 23 02 18 01 85 03 00 C0", "605 2B 02 18 03 00 00"):
        assert master.send(step)[0].data[0] == 0x60  # a disabled PDO causes no load
    assert frames_match(VALUE_ABORT.format(2, 1), master.send("605 23 02 18 01 85 03 00 40"))


@pytest.mark.parametrize("change", [((FORCE, 1), 0xC000_0185), ((FORCE, 2), 1)])
def test_a_disabled_or_synchronous_pdo_is_not_counted(change):
    assert abort_code_of(FORCE, 5, 2) is AbortCode.INVALID_VALUE
    assert abort_code_of(FORCE, 5, 2, before=[change]) is None
