"""Benchmarks of the firmware binary on the emulated chip, in board time."""

import subprocess
import time

from pneuforce.protocol.frames import (
    BoardState,
    Command,
    CommandFlag,
    FrameDecoder,
    Identify,
    Mode,
    Sample,
    Valve,
    encode,
)
from pneuforce.sim.avr.board import AvrBoard
from pneuforce.sim.avr.emulator import CYCLES_PER_US
from pneuforce.sim.avr.toolchain import program
from pneuforce.sim.board import SimulatedBoard
from pneuforce.sim.hand import Hand
from pneuforce.sim.plants.published import PublishedPlant
from pneuforce.sim.rig import STEP_S, Rig
from tests.firmware.test_on_chip import BEGINNINGS, flooded
from tests.sim.conftest import Bench

CYCLES_PER_MS = 1000 * CYCLES_PER_US
LOOK_EACH_CYCLES = 20 * CYCLES_PER_US
PHASES = 10  #: number of instants within a sample period at which the input changes
SUM_OF_19_KPA, SUM_OF_26_KPA = (round(16384 * (0.018 * (kpa + 0.25) + 0.04) - 8) for kpa in (19.0, 26.0))


def _ms_to_vent(adc_sum, phase):
    """Return the time [ms] from a change at the sensor to a change at the pin of the vent valve."""
    board = Bench(AvrBoard()).holding().board
    chip, supply_mv = board.chip, 5000
    chip.run(chip.cycle + phase * 2 * CYCLES_PER_MS // PHASES)
    begun = chip.cycle
    chip.set_inputs(adc_sum, supply_mv)
    while board.valves & Valve.VENT_CLOSED and chip.cycle < begun + 200 * CYCLES_PER_MS:
        chip.run(chip.cycle + LOOK_EACH_CYCLES)
    return (chip.cycle - begun) / CYCLES_PER_MS


def _ms_to_shut():
    """Return the time [ms] from the last command during an inflation until the inlet pin is low."""
    bench = Bench(AvrBoard()).inflating(12_000)
    bench.until(lambda: bench.last().command == bench._sequence & 0xFF, 0.1)
    sent_us = next(s for s in bench.all(Sample) if s.command == bench.last().command).board_time_us
    bench.command = None
    bench.until(lambda: not bench.board.valves & Valve.INLET_OPEN, 1)
    # The host sent the command at most one sample period (2 ms) before the board executed it.
    return (bench.now_us - sent_us) / 1e3 + 2


def bench_reactions(phases):
    """Print the reaction times of the valves."""
    for name, adc_sum, limit_ms in (
        ("contact limit exceeded (19 kPa) → vent pin", SUM_OF_19_KPA, 20),
        ("hard limit exceeded (26 kPa) → vent pin", SUM_OF_26_KPA, 20),
        ("sensor line open → vent pin", 16_368, 100),
        ("sensor line short-circuited → vent pin", 0, 100),
    ):
        took_ms = [_ms_to_vent(adc_sum, phase) for phase in range(phases)]
        print(f"board, {name}: {min(took_ms):.1f} to {max(took_ms):.1f} ms (target {limit_ms})")
    print(f"board, last command of the host → inlet pin low: {_ms_to_shut():.0f} ms (target 270)")


def _settle(new_board, setpoint_pa):
    """Return the time to HOLDING [s], the number of valve actions, and the pressure 2 s later [kPa]."""
    rig, decoder = Rig(PublishedPlant(), Hand(False), new_board=new_board), FrameDecoder.for_board_frames()
    state, valves, actions, held_s = BoardState.BOOT, 0, 0, None
    for n in range(round(12 / STEP_S)):
        mode = Mode.VENT if n * STEP_S < 1.5 else Mode.HOLD
        command = Command(mode, CommandFlag.ZEROED, setpoint_pa, 250)
        received = encode(command if n else Identify(), n) if n % 25 == 0 else b""
        samples = [f.message for f in decoder.feed(rig.step(received)) if isinstance(f.message, Sample)]
        state = samples[-1].state if samples else state
        actions += rig.board.valves != valves
        valves = rig.board.valves
        if state == BoardState.HOLDING and held_s is None:
            held_s = n * STEP_S - 1.5
        if held_s is not None and n * STEP_S > held_s + 3.5:
            break
    return held_s, actions, rig.truth.balloon_kpa


def bench_settling(setpoints_pa):
    """Print duration, number of valve actions and final pressure of an inflation to each setpoint."""
    for setpoint_pa in setpoints_pa:
        for new_board in (AvrBoard, SimulatedBoard):
            held_s, actions, balloon_kpa = _settle(new_board, setpoint_pa)
            print(
                f"{new_board.__name__} inflated to {setpoint_pa / 1e3:g} kPa: "
                f"holding after {held_s:.2f} s (target 8), {actions} valve actions (target 20), "
                f"{balloon_kpa:.3f} kPa (target ± 0.1)"
            )


def bench_speed(seconds):
    """Print the speed of the emulated board during a hold, and the maximum number of cycles per sample."""
    bench = Bench(AvrBoard()).holding()
    begun_s = time.process_time()
    bench.run(seconds)
    took_s = time.process_time() - begun_s
    chip = bench.board.chip
    print(f"emulated board on a simulated rig: {seconds / took_s:.1f} × real time (target 5)")
    print(
        f"longest work on one sample: {chip.longest_cycles} of 32000 cycles without a flood; "
        f"bytes that a real UART would have lost: {chip.overruns}"
    )


def bench_flood(beginnings):
    """Print the maximum number of cycles per sample while a host floods the line with incomplete frames."""
    for beginning in beginnings:
        longest = flooded(beginning).board.chip.longest_cycles
        print(f"longest work on one sample, flood of frame starts {beginning}: {longest} of 32000 cycles")


def bench_size():
    """Print how many bytes of flash and RAM the firmware uses."""
    said = subprocess.run(["avr-size", program()], check=True, capture_output=True, text=True).stdout
    text, data, bss = map(int, said.splitlines()[1].split()[:3])
    print(f"firmware: {text + data} bytes of flash (limit 30720), {data + bss} of RAM (limit 1600)")


def bench_avr(brief=False):
    """Run all benchmarks of the board."""
    bench_size()
    bench_speed(0.1 if brief else 10)
    bench_flood(list(BEGINNINGS)[:1] if brief else BEGINNINGS)
    bench_reactions(1 if brief else PHASES)
    bench_settling((5000,) if brief else (5000, 8000, 11_450))


if __name__ == "__main__":
    bench_avr()
