"""The firmware's binary as the board of a simulated rig."""

import re
from pathlib import Path

import pytest

from instrument.rig.frames import (
    BoardKind,
    Command,
    CommandFlag,
    Decoder,
    Hello,
    Identify,
    Mode,
    Sample,
    encode,
)
from sim.avr import board as avr
from sim.avr.board import AvrBoard
from sim.faults import Refused
from sim.hand import Hand
from sim.published import PublishedPlant
from sim.rig import Rig
from sim.world import World
from tests.sim.conftest import AVR_MARKS, brief

pytestmark = [*AVR_MARKS, brief]

HARDWARE = Path(__file__).parents[3] / "firmware/pneuforce/hardware.h"


def rig(seed=1, works=False):
    return Rig(PublishedPlant(), Hand(works), seed, new_board=AvrBoard)


def drive(rig, seconds):
    """What it sends while it is greeted, vented for a second, and asked for 8 kPa."""
    sent = b""
    for n in range(round(seconds * 500)):
        mode = Mode.VENT if n < 500 else Mode.HOLD
        command = Command(mode, CommandFlag.ZEROED, 8000, 250)
        sent += rig.step(encode(command if n else Identify(), n) if n % 25 == 0 else b"")
    return sent


def test_it_says_that_it_is_emulated_and_which_one_it_is():
    [frame] = Decoder.of_board().feed(AvrBoard(serial=70_001).step(2000, 1000, 5000, b""))
    assert isinstance(frame.message, Hello)
    assert (frame.message.board, frame.message.serial) == (BoardKind.EMULATED, 70_001)


def test_it_fills_the_balloon_of_the_rig_and_loses_no_byte():
    driven = rig()
    drive(driven, 5)
    assert driven.board.holds
    assert driven.truth.balloon_kpa == pytest.approx(8.0, abs=0.1)
    assert driven.board.chip.overruns == 0
    assert driven.board.chip.longest_cycles < 32_000


def test_the_same_seed_gives_the_same_bytes_and_another_seed_does_not():
    once, again, other = (drive(rig(seed), 1.5) for seed in (1, 1, 2))
    assert once == again
    assert once != other


def test_a_sample_shows_what_the_sensor_gave_in_the_step_before():
    board, decoder = AvrBoard(), Decoder.of_board()
    seen = []
    for n in range(1, 40):
        sent = board.step(2000 * n, 900 + n, 5000, encode(Identify(), 1) if n == 1 else b"")
        seen += [(n, f.message.adc_sum) for f in decoder.feed(sent) if isinstance(f.message, Sample)]
    assert len(seen) == 39
    assert all(adc_sum == 900 + n - 1 for n, adc_sum in seen[1:])


def test_its_clock_follows_the_quartz():
    driven = rig()
    driven.clock_rate = 1.01
    samples = [f.message for f in Decoder.of_board().feed(drive(driven, 2)) if isinstance(f.message, Sample)]
    assert len(samples) == pytest.approx(1010, abs=1)


def test_a_quartz_that_stands_still_says_nothing():
    driven = rig()
    drive(driven, 0.1)
    driven.frozen_board = True
    assert drive(driven, 0.1) == b""


def test_a_reset_board_boots_anew_and_the_balloon_empties():
    driven = rig()
    drive(driven, 5)
    driven.reset_board()
    [frame] = Decoder.of_board().feed(driven.step())
    assert frame.message.uptime_ms == 2
    for _ in range(1000):
        driven.step()
    assert driven.truth.balloon_kpa < 0.5


def test_no_fault_changes_what_was_flashed():
    world = World(rig())
    with pytest.raises(Refused, match="the version of the protocol that it was flashed with"):
        world.faults.put_in("other_version")
    assert world.faults.present == {}


def test_the_pins_are_those_of_the_firmware():
    bits = dict(re.findall(r"#define (\w+_BIT) (\d+)", HARDWARE.read_text()))
    assert {name: int(bits[name]) for name in ("INLET_BIT", "VENT_BIT", "OK_BIT")} == {
        name: getattr(avr, name) for name in ("INLET_BIT", "VENT_BIT", "OK_BIT")
    }
