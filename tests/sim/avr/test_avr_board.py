"""Tests of the emulated board in a simulated rig."""

import re
from pathlib import Path

import pytest

from pneuforce.protocol.firmware_images import IMAGES
from pneuforce.protocol.frames import (
    BoardKind,
    Command,
    CommandFlag,
    Fault,
    FrameDecoder,
    Hello,
    Identify,
    Mode,
    Sample,
    Valve,
    encode,
)
from pneuforce.sim.avr import board as avr
from pneuforce.sim.avr.board import AvrBoard
from pneuforce.sim.avr.emulator import ResetFlag
from pneuforce.sim.avr.toolchain import HEX
from pneuforce.sim.board.board import FIRMWARE_REVISION
from pneuforce.sim.board.image_table import crc_of
from pneuforce.sim.faults import SimulatorRequestError
from pneuforce.sim.hand import Hand
from pneuforce.sim.plants.published import PublishedPlant
from pneuforce.sim.rig import Rig
from pneuforce.sim.world import World
from tests.sim.conftest import AVR_MARKS, brief
from tests.sim.station import Station

pytestmark = [*AVR_MARKS, brief]

HARDWARE = Path(__file__).parents[3] / "firmware/pneuforce/hardware.h"


def rig(seed=1, works=False):
    return Rig(PublishedPlant(), Hand(works), seed, new_board=AvrBoard)


def drive(rig, seconds):
    """Send Identify, vent for a second, then request 8 kPa. Return the bytes that the board sends."""
    sent = b""
    for n in range(round(seconds * 500)):
        mode = Mode.VENT if n < 500 else Mode.HOLD
        command = Command(mode, CommandFlag.ZEROED, 8000, 250)
        sent += rig.step(encode(command if n else Identify(), n) if n % 25 == 0 else b"")
    return sent


def messages_after_boot(board):
    sent = board.step(2000, 1000, 5000, b"")
    return [frame.message for frame in FrameDecoder.for_board_frames().feed(sent)]


def test_the_hello_reports_an_emulated_board_and_its_serial_number():
    _image, hello = messages_after_boot(AvrBoard(serial=70_001))
    assert isinstance(hello, Hello)
    assert (hello.board, hello.serial) == (BoardKind.EMULATED, 70_001)


def test_the_board_reports_the_crc_of_its_flash():
    board = AvrBoard()
    board._boot(HEX, ResetFlag.POWER_ON)  # the program with which real boards are flashed
    image, hello = messages_after_boot(board)
    assert (hello.firmware, image.crc) == (FIRMWARE_REVISION, IMAGES[FIRMWARE_REVISION])


def test_a_flash_with_one_wrong_bit_has_another_crc(tmp_path):
    *records, constants, end = HEX.read_text().splitlines()
    record = bytearray.fromhex(constants[1:])
    record[-2] ^= 1
    record[-1] = -sum(record[:-1]) & 0xFF  # the check sum of the record
    damaged = tmp_path / "damaged.hex"
    damaged.write_text("\n".join([*records, f":{record.hex().upper()}", end, ""]))
    board = AvrBoard()
    board._boot(damaged, ResetFlag.POWER_ON)
    image, hello = messages_after_boot(board)
    assert (hello.firmware, image.crc) == (FIRMWARE_REVISION, crc_of(damaged))
    assert image.crc != IMAGES[FIRMWARE_REVISION]


def test_the_board_fills_the_balloon_of_the_rig_and_loses_no_byte():
    driven = rig()
    drive(driven, 5)
    assert driven.board.is_holding
    assert driven.truth.balloon_kpa == pytest.approx(8.0, abs=0.1)
    assert driven.board.chip.overruns == 0
    assert driven.board.chip.longest_cycles < 32_000


def test_the_same_seed_gives_the_same_bytes_and_another_seed_does_not():
    once, again, other = (drive(rig(seed), 1.5) for seed in (1, 1, 2))
    assert once == again
    assert once != other


def test_a_sample_contains_the_adc_sum_of_the_previous_step():
    board, decoder = AvrBoard(), FrameDecoder.for_board_frames()
    seen = []
    for n in range(1, 40):
        sent = board.step(2000 * n, 900 + n, 5000, encode(Identify(), 1) if n == 1 else b"")
        seen += [(n, f.message.adc_sum) for f in decoder.feed(sent) if isinstance(f.message, Sample)]
    assert len(seen) == 39
    assert all(adc_sum == 900 + n - 1 for n, adc_sum in seen[1:])


def test_the_board_clock_follows_the_crystal():
    driven = rig()
    driven.clock_rate = 1.01
    frames = FrameDecoder.for_board_frames().feed(drive(driven, 2))
    samples = [frame.message for frame in frames if isinstance(frame.message, Sample)]
    assert len(samples) == pytest.approx(1010, abs=1)


def holding(fault):
    """Return a station whose balloon is held, with the fault injected."""
    station = Station(PublishedPlant(), new_board=AvrBoard).holding()
    station.world.faults.inject(fault)
    return station


def test_a_board_with_a_stopped_crystal_sends_nothing_and_its_watchdog_vents_within_64_ms():
    station = holding("board_frozen")
    station.run(0.062)
    assert station.world.rig.board.valves == Valve.VENT_CLOSED
    station.run(0.004)
    assert station.world.rig.board.valves == Valve.NONE
    station.run(2.0)
    assert {"link_lost", "failure"} <= station.snapshot().status
    station.world.faults.remove("board_frozen")
    assert station.run(2.0, lambda: Fault.WATCHDOG in station.snapshot().faults)
    assert station.world.rig.truth.balloon_kpa < 1.0


def test_a_short_stop_of_the_crystal_changes_nothing():
    station = holding("board_frozen")
    station.run(0.05)
    station.world.faults.remove("board_frozen")
    station.run(1.0)
    assert (station.snapshot().state, station.snapshot().faults) == ("holding", ())


def test_a_reset_board_boots_and_the_balloon_empties():
    driven = rig()
    drive(driven, 5)
    driven.reset_board()
    _image, hello = FrameDecoder.for_board_frames().feed(driven.step())
    assert hello.message.uptime_ms == 2
    for _ in range(1000):
        driven.step()
    assert driven.truth.balloon_kpa < 0.5


def test_a_board_with_another_version_is_rejected_until_the_right_version_is_flashed():
    station = holding("other_version")
    assert station.run(2.0, lambda: station.rejection)
    assert "version 2 of the rig link" in str(station.rejection)
    assert station.snapshot().state == "tripped"
    used = station.used_samples
    station.run(1.0)
    assert station.used_samples == used
    assert station.world.rig.board.valves == Valve.NONE
    station.world.faults.remove("other_version")
    assert station.run(2.0, lambda: station.used_samples > used)


def test_without_a_compiler_another_version_is_rejected_with_the_missing_package(monkeypatch):
    world = World(rig())
    monkeypatch.setattr("shutil.which", lambda _: None)
    with pytest.raises(SimulatorRequestError, match="apt-get install gcc-avr"):
        world.faults.inject("other_version")
    assert world.faults.active == {}


def test_the_pins_are_the_pins_of_the_firmware():
    bits = dict(re.findall(r"#define (\w+_BIT) (\d+)", HARDWARE.read_text()))
    assert {name: int(bits[name]) for name in ("INLET_BIT", "VENT_BIT", "OK_BIT")} == {
        name: getattr(avr, name) for name in ("INLET_BIT", "VENT_BIT", "OK_BIT")
    }
