"""How much of its bus the node may be made to take: never more than 60 %."""

import pytest

from registers.can.options import HIGHEST_LOAD, Options
from registers.can.wire import longest_bits
from registers.canopen.abort import Abort, Why
from registers.canopen.parameters import Parameters
from tests.registers.canopen.cases import OPERATIONAL
from tests.registers.canopen.talking import Master, agrees

SLOW = 125_000
FORCE, STATUS = 0x1800, 0x1802
ALARM, CALM = frozenset({"holding", "force_limit"}), frozenset({"holding"})
VALUE = "585 80 {:02X} 18 {:02X} 30 00 09 06"


def refusal(index, sub, value, before=(), bit_rate=SLOW):
    """Why a parameter is not set; None where it is."""
    parameters = Parameters(Options(bit_rate=bit_rate))
    for at, code in before:
        parameters.set(at, code)
    try:
        parameters.set((index, sub), value)
    except Abort as abort:
        return abort.why
    return None


@pytest.mark.parametrize(
    ("inhibit", "why"), [(0, Why.VALUE), (10, Why.VALUE), (29, Why.VALUE), (30, None), (99, None)]
)
def test_a_status_that_may_flicker_with_each_sample_is_counted_so(inhibit, why):
    before = [((STATUS, 1), 0xC000_0385), ((STATUS, 3), inhibit)]
    assert refusal(STATUS, 1, 0x4000_0385, before) is why  # there is room for 341 a second
    assert refusal(STATUS, 1, 0x4000_0385, before, bit_rate=500_000) is None


def flickering(master, seconds):
    """Bits that the node sends while its status changes with each sample."""
    bits = 0
    for step in range(round(seconds / 0.002)):
        master.now_s += 0.002
        master.rig.set(status=ALARM if step % 2 else CALM)
        frames = master.node.on_sample(master.now_s)
        frames += master.node.tick(master.now_s) if step % 5 == 0 else []
        bits += sum(longest_bits(len(frame.data)) for frame in frames)
    return bits


@pytest.mark.parametrize("inhibit", [0, 10, 20, 30, 50, 99, 100])
def test_a_flickering_status_takes_no_more_than_that_whatever_was_asked(inhibit):
    master = Master(OPERATIONAL, bit_rate=SLOW)
    for said in (
        "605 23 02 18 01 85 03 00 C0",
        f"605 2B 02 18 03 {inhibit:02X}",
        "605 23 02 18 01 85 03 00 40",
    ):
        master.say(said)
    assert flickering(master, 2.0) / 2.0 / SLOW <= HIGHEST_LOAD


def test_what_was_refused_while_it_would_load_the_bus_is_refused_when_switched_on_too():
    master = Master(bit_rate=SLOW)
    for said in ("605 23 02 18 01 85 03 00 C0", "605 2B 02 18 03 00 00"):
        assert master.say(said)[0].data[0] == 0x60  # what is off takes nothing
    assert agrees(VALUE.format(2, 1), master.say("605 23 02 18 01 85 03 00 40"))


@pytest.mark.parametrize("silenced", [((FORCE, 1), 0xC000_0185), ((FORCE, 2), 1)])
def test_what_is_off_or_sent_at_sync_is_not_counted(silenced):
    assert refusal(FORCE, 5, 2) is Why.VALUE
    assert refusal(FORCE, 5, 2, before=[silenced]) is None
