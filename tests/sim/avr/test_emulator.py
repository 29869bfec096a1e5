"""Tests of the emulated chip and its wiring with the test program tests/sim/avr/probe.c."""

from pathlib import Path

import pytest

from pneuforce.sim.avr import toolchain
from pneuforce.sim.avr.emulator import CYCLES_PER_US, Emulator, FirmwareCrashed, ResetFlag
from tests.tools import needs

pytestmark = [needs("gcc-avr", "/usr/bin/avr-gcc"), needs("libsimavr-dev", "/usr/include/simavr")]

MS = 1000 * CYCLES_PER_US
POWER_ON, WATCHDOG = 1, 8


class Probe(Emulator):
    """Chip that runs the test program, with methods that decode its output."""

    def __init__(self, eeprom=b""):
        super().__init__(toolchain.program(Path(__file__).with_name("probe.c")), eeprom)
        self.set_inputs(8000, 5000)

    def after(self, milliseconds):
        """Run the chip for a time and return the bytes that it sends."""
        self.run(self.cycle + round(milliseconds * MS))
        return self.sent()

    def booted(self):
        self.after(10)
        return self

    def sums_and_bandgaps(self, milliseconds):
        """Run the chip for a time. Return the ADC sums and the bandgap conversions.

        The chip started the first sum with the previous inputs.
        """
        words = memoryview(self.after(milliseconds))
        words = words[: len(words) // 4 * 4].cast("H")
        return words[::2].tolist(), words[1::2].tolist()


def test_the_chip_runs_to_a_cycle_and_at_most_one_instruction_further():
    probe = Probe()
    for cycle in (1, 1000, 999_999, 1_000_000):
        probe.run(cycle)
        assert cycle <= probe.cycle <= cycle + 4


def test_the_eeprom_starts_with_the_preset_bytes_and_is_erased_beyond():
    assert Probe(bytes([1, 7, 9])).after(1) == bytes([POWER_ON, 1, 7, 9, 0xFF])


@pytest.mark.parametrize("adc_sum", [0, 1, 163, 8000, 8001, 8015, 16041, 16368])
def test_16_conversions_add_up_to_the_sum_that_was_set(adc_sum):
    probe = Probe().booted()
    probe.set_inputs(adc_sum, 5000)
    sums, _ = probe.sums_and_bandgaps(20)
    assert set(sums[1:]) == {adc_sum}


def test_a_sum_does_not_mix_two_inputs():
    probe = Probe().booted()
    probe.after(1)  # in the middle of a sum
    probe.set_inputs(16368, 5000)
    sums, _ = probe.sums_and_bandgaps(20)
    assert set(sums) == {8000, 16368}


@pytest.mark.parametrize("supply_mv", [2700, 4749, 4750, 5000, 5251, 65_535])
def test_the_mean_bandgap_conversion_gives_the_supply(supply_mv):
    probe = Probe().booted()
    probe.set_inputs(8000, supply_mv)
    _, bandgaps = probe.sums_and_bandgaps(1000)
    mean = sum(bandgaps[1:]) / len(bandgaps[1:]) + 0.5  # truncation lowers the mean by half a count
    assert 1100 * 1024 / mean == pytest.approx(supply_mv, rel=1e-3)
    assert max(bandgaps[1:]) - min(bandgaps[1:]) <= 1


def test_bytes_arrive_at_the_bit_rate_of_the_line_and_are_sent_back():
    probe = Probe().booted()
    probe.receive(b"KLMNOPQRST" * 2)
    early = bytes(b for b in probe.after(0.1) if b in b"KLMNOPQRST")
    late = bytes(b for b in probe.after(4) if b in b"KLMNOPQRST")
    assert 1 <= len(early) <= 5
    assert early + late == b"KLMNOPQRST" * 2


def test_a_byte_that_a_real_uart_would_lose_is_counted():
    probe = Probe().booted()
    probe.receive(b"h" + b"ab")
    probe.after(1)
    assert probe.overruns == 0
    probe.receive(b"c")
    probe.after(1)
    assert probe.overruns == 1


def test_pins_are_readable_and_low_after_a_reset():
    probe = Probe().booted()
    assert probe.high("D") & 0x90 == 0x80
    probe.set_inputs(8001, 5000)
    probe.after(6)
    assert probe.high("D") & 0x90 == 0x90
    probe.reset(ResetFlag.EXTERNAL)
    assert probe.high("D") == 0


@pytest.mark.parametrize("cause", ResetFlag)
def test_a_reset_sets_the_flag_of_its_cause(cause):
    probe = Probe().booted()
    probe.sent()
    probe.reset(cause)
    assert probe.after(1)[0] == cause


def test_a_program_that_hangs_is_reset_by_its_watchdog_and_runs_again():
    probe = Probe().booted()
    probe.receive(b"h")
    probe.after(1)
    assert probe.after(25) == b""
    assert probe.after(20)[0] == WATCHDOG
    assert probe.resets == 1
    assert probe.cycle >= 56 * MS


def test_the_processing_time_of_a_sum_is_measured():
    """After each sum, the program sends four bytes. Each byte that the UART cannot buffer takes 20 µs."""
    probe = Probe().booted()
    assert 20 * CYCLES_PER_US < probe.longest_cycles < 300 * CYCLES_PER_US


def test_the_same_calls_give_the_same_bytes():
    def output():
        probe = Probe()
        probe.receive(b"abc")
        return probe.after(30)

    assert output() == output()


# missing tools


def test_a_missing_compiler_is_named_with_its_package(monkeypatch):
    monkeypatch.setattr(toolchain.shutil, "which", lambda name: None)
    with pytest.raises(toolchain.ToolchainError, match="avr-gcc: apt-get install gcc-avr avr-libc"):
        toolchain.program(Path(__file__).with_name("probe.c"))


def test_a_missing_library_is_named_with_its_package(monkeypatch, tmp_path):
    monkeypatch.setattr(toolchain, "HEADERS", tmp_path / "none")
    with pytest.raises(toolchain.ToolchainError, match="simavr: apt-get install libsimavr-dev"):
        toolchain.harness()


def test_source_that_does_not_compile_is_a_toolchain_error_and_leaves_no_file(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    broken = tmp_path / "broken.c"
    broken.write_text("int main(void) { return }")
    with pytest.raises(toolchain.ToolchainError, match="avr-gcc"):
        toolchain.program(broken)
    assert list((tmp_path / "cache" / "pneuforce").iterdir()) == []


def test_a_file_without_a_program_is_a_value_error_that_names_the_file(tmp_path):
    (tmp_path / "text").write_text("not a program")
    with pytest.raises(ValueError, match="ATmega328P"):
        Emulator(tmp_path / "text")


def test_a_program_that_stops_the_processor_is_a_crash(tmp_path):
    sleeps = tmp_path / "sleeps.c"
    sleeps.write_text("#include <avr/sleep.h>\nint main(void) { sleep_enable(); sleep_cpu(); for (;;); }")
    with pytest.raises(FirmwareCrashed, match=r"crashed after \d"):
        Emulator(toolchain.program(sleeps)).run(MS)
