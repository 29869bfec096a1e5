"""The firmware's binary as the board of a simulated rig."""

import re
from pathlib import Path

import pytest

from instrument.rig.frames import (
    BoardKind,
    Command,
    CommandFlag,
    Decoder,
    Fault,
    Hello,
    Identify,
    Mode,
    Sample,
    Valve,
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
from tests.sim.station import Station

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


def holding(fault):
    """A host and a rig that holds, and then has the fault."""
    station = Station(PublishedPlant(), new_board=AvrBoard).holding()
    station.world.faults.put_in(fault)
    return station


def test_without_its_quartz_it_says_nothing_and_its_watchdog_vents_within_64_ms():
    station = holding("board_frozen")
    station.run(0.062)
    assert station.world.rig.board.valves == Valve.VENT_CLOSED
    station.run(0.004)
    assert station.world.rig.board.valves == Valve.NONE
    station.run(2.0)
    assert {"link_lost", "failure"} <= station.see().status
    station.world.faults.take_out("board_frozen")
    assert station.run(2.0, lambda: Fault.WATCHDOG in station.see().faults)
    assert station.world.rig.truth.balloon_kpa < 1.0


def test_a_quartz_that_stands_still_for_a_moment_changes_nothing():
    station = holding("board_frozen")
    station.run(0.05)
    station.world.faults.take_out("board_frozen")
    station.run(1.0)
    assert (station.see().state, station.see().faults) == ("holding", ())


def test_a_reset_board_boots_anew_and_the_balloon_empties():
    driven = rig()
    drive(driven, 5)
    driven.reset_board()
    [frame] = Decoder.of_board().feed(driven.step())
    assert frame.message.uptime_ms == 2
    for _ in range(1000):
        driven.step()
    assert driven.truth.balloon_kpa < 0.5


def test_flashed_with_another_version_it_greets_and_the_host_refuses_it_until_it_is_flashed_back():
    station = holding("other_version")
    assert station.run(2.0, lambda: station.refused)
    assert "the board speaks version 2 of the rig link" in str(station.refused)
    assert station.see().state == "tripped"
    used = station.used
    station.run(1.0)
    assert station.used == used
    assert station.world.rig.board.valves == Valve.NONE
    station.world.faults.take_out("other_version")
    assert station.run(2.0, lambda: station.used > used)


def test_without_a_compiler_another_version_is_refused_in_a_sentence(monkeypatch):
    world = World(rig())
    monkeypatch.setattr("shutil.which", lambda _: None)
    with pytest.raises(Refused, match="the emulated board needs avr-gcc: apt-get install"):
        world.faults.put_in("other_version")
    assert world.faults.present == {}


def test_the_pins_are_those_of_the_firmware():
    bits = dict(re.findall(r"#define (\w+_BIT) (\d+)", HARDWARE.read_text()))
    assert {name: int(bits[name]) for name in ("INLET_BIT", "VENT_BIT", "OK_BIT")} == {
        name: getattr(avr, name) for name in ("INLET_BIT", "VENT_BIT", "OK_BIT")
    }
