"""Tests of the sketch on the emulated chip: watchdog, late samples, flooded line, buffers and conversions."""

from itertools import pairwise

import pytest

from pneuforce.protocol.frames import (
    SYNC,
    BoardKind,
    BoardState,
    Fault,
    FrameDecoder,
    Identify,
    Sample,
    Valve,
    Vent,
    encode,
)
from pneuforce.sim.avr.board import AvrBoard
from pneuforce.sim.avr.emulator import Emulator
from pneuforce.sim.avr.toolchain import program
from tests.firmware.altered import altered, waiting
from tests.sim.conftest import AVR_MARKS, Bench, brief, hold, vent

BYTES_PER_SAMPLE = 100  #: largest number of bytes that the line transfers in one sample period

pytestmark = [*AVR_MARKS, brief]


@pytest.mark.parametrize("reset_flags", ["MCUSR", "0"], ids=["as reset", "cleared by a bootloader"])
def test_a_main_loop_that_hangs_vents_within_40_ms_and_the_reset_is_reported(tmp_path, reset_flags):
    flags = ("reset_flags = MCUSR;", f"reset_flags = {reset_flags};")
    bench = holding_at_6_s(waiting(tmp_path, "now_us > 6000000ul", flags=flags))
    bench.run(0.01)
    assert (bench.board.valves, bench.board.ok) == (Valve.VENT_CLOSED, True)
    bench.run(0.04)
    assert_the_board_has_failed_safe(bench)


def holding_at_6_s(board):
    bench = Bench(board)
    bench.identify().run(0.1).keep_sending(vent()).until_state(BoardState.VENTED, 3)
    bench.keep_sending(hold()).until_state(BoardState.HOLDING, 5)
    bench.until(lambda: bench.now_us >= 6_000_000, 5)
    assert (bench.board.valves, bench.board.ok) == (Valve.VENT_CLOSED, True)
    return bench


def assert_the_board_has_failed_safe(bench):
    """Check that the board vents, opens its contact, resets, and then reports fault WATCHDOG."""
    resets, frames_before = bench.board.chip.resets, len(bench.frames)
    assert (bench.board.valves, bench.board.ok) == (Valve.NONE, False)
    bench.run(0.2)  # a boot takes 0.11 s
    assert bench.board.chip.resets == resets + 1
    bench.identify().run(0.1)
    after = [f.message for f in bench.frames[frames_before:] if isinstance(f.message, Sample)]
    assert after[-1].state == BoardState.TRIPPED
    assert after[-1].faults == 1 << Fault.WATCHDOG


@pytest.mark.parametrize("late_us", [2000, 20_000])
def test_a_main_loop_that_is_late_for_a_sample_vents_at_once(tmp_path, late_us):
    """All time-outs are counted in samples. A missed sample would make every time-out longer."""
    bench = holding_at_6_s(waiting(tmp_path, f"now_us > 6000000ul && time_us - now_us <= {late_us}ul"))
    bench.run(late_us * 1e-6 + 0.006)
    assert_the_board_has_failed_safe(bench)


def test_a_pass_of_the_main_loop_that_takes_nearly_a_sample_period_is_not_late(tmp_path):
    """The pass starts 0.3 ms before a sample period and ends 1.5 ms after the start of this period."""
    late = "(time_us == now_us || TCNT1 < F_CPU / 2000 * 3)"
    board = waiting(tmp_path, f"now_us % 200000ul == 0 && {late}")
    bench = Bench(board).identify().keep_sending(vent())
    bench.run(1)
    assert 28_800 < board.chip.longest_cycles < 32_000
    assert (board.chip.resets, bench.state) == (0, BoardState.VENTED)


#: Starts of frames. A line full of them takes the most processing time, because the decoder checks and
#: rejects a frame at each start.
BEGINNINGS = {"of any kind": SYNC, "of identify": SYNC + b"\x99", "of commands": SYNC + b"\xaa\x01"}


def flooded(beginning):
    """Return a bench that inflates while a host fills the line with starts of frames."""
    bench, flood = Bench(AvrBoard()).inflating(), BEGINNINGS[beginning] * 12_000
    for at in range(0, 30_000, BYTES_PER_SAMPLE):
        bench.to_send = flood[at : at + BYTES_PER_SAMPLE]
        bench.step()
    return bench


@pytest.mark.parametrize("beginning", BEGINNINGS)
def test_a_line_full_of_frame_starts_delays_no_sample(beginning):
    bench = flooded(beginning)
    chip = bench.board.chip
    assert chip.longest_cycles < 24_000  # a sample period has 32 000 cycles; a quarter must stay free
    assert (chip.resets, chip.overruns) == (1, 0)
    times_us = [sample.board_time_us for sample in bench.all(Sample)]
    assert {later - earlier for earlier, later in pairwise(times_us)} == {2000}


def test_bytes_that_follow_a_frame_do_not_overwrite_it():
    bench = Bench(AvrBoard()).holding()
    bench.command = None
    bench.to_send = bytes(BYTES_PER_SAMPLE) + bench.frame(Vent()) + bytes(2 * BYTES_PER_SAMPLE)
    bench.run(0.02)
    assert bench.state is BoardState.VENTING


def test_a_line_that_is_too_slow_for_all_frames_loses_complete_frames_only(tmp_path):
    often = (
        "        transmit(board.out + n);\n",
        "        for (uint8_t i = 0; i < 6; i++) transmit(board.out + n);\n",
    )
    board, decoder = altered(tmp_path, often=often), FrameDecoder.for_board_frames()
    sent = board.step(2000, 8000, 5000, encode(Identify(), 1))
    sent += b"".join(board.step(2000 * n, 8000, 5000, b"") for n in range(2, 200))
    frames = decoder.feed(sent)
    assert len(frames) > 500
    assert (decoder.rejected_frames, decoder.skipped_bytes) == (0, 0)


def test_the_supply_is_not_converted_during_a_sum(tmp_path):
    early = ("(CYCLES_PER_SAMPLE / 100 * 93)", "(CYCLES_PER_SAMPLE / 100 * 50)")
    bench = Bench(altered(tmp_path, early=early)).identify()
    bench.adc_sum = 8000
    bench.run(0.2)
    assert {sample.adc_sum for sample in bench.all(Sample)[2:]} == {8000}
    assert bench.board.chip.resets == 0


@pytest.mark.parametrize(
    ("bandgap_mv", "supply_mv"),
    [(0, 5000), (999, 5000), (1000, 4545), (1200, 5454), (1201, 5000), (60_000, 5000), (0xFFFF, 5000)],
)
def test_an_implausible_reference_in_the_eeprom_is_replaced_by_the_nominal_reference(bandgap_mv, supply_mv):
    bench = Bench(AvrBoard())
    kind_and_serial = bytes([BoardKind.REAL, 7, 0, 0, 0])
    bench.board.chip = Emulator(program(), kind_and_serial + bandgap_mv.to_bytes(2, "little"))
    bench.identify().run(0.1)
    assert bench.last().supply_mv == pytest.approx(supply_mv, abs=5)
