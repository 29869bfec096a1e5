"""The sketch as it is flashed: it fits, it also builds as the Arduino IDE would, and a hang ends SAFE."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from instrument.rig.frames import BoardState, Fault, Sample, Valve
from sim.avr.board import AvrBoard
from sim.avr.emulator import CYCLES_PER_US, Emulator
from sim.avr.toolchain import HEX, SKETCH
from tests.sim.conftest import Bench, hold, vent
from tests.tools import needs

ROOT = Path(__file__).parents[2]
CORE = Path("/usr/share/arduino/hardware/arduino/avr")
MS = 1000 * CYCLES_PER_US
#: Debian 12. Another version makes other bytes of the same source.
RELEASED_BY = "5.4.0"

pytestmark = needs("gcc-avr", "/usr/bin/avr-gcc")
emulated = needs("libsimavr-dev", "/usr/include/simavr")


def run(*command):
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def into(folder):
    return f"ELF={folder}/pneuforce.elf", f"HEX={folder}/pneuforce.hex"


def compiler():
    """Version of avr-gcc, empty where it is missing."""
    return run("avr-gcc", "-dumpversion").strip() if shutil.which("avr-gcc") else ""


def test_make_firmware_builds_without_a_warning_and_says_what_it_takes(tmp_path):
    said = run("make", "firmware", *into(tmp_path))
    assert re.search(r"\d+ bytes of flash \(limit 30720\), \d+ of RAM", said)


@pytest.mark.skipif(compiler() != RELEASED_BY, reason=f"avr-gcc {RELEASED_BY} made the committed program")
def test_the_committed_program_is_what_the_sketch_makes(tmp_path):
    run("make", "firmware", *into(tmp_path))
    assert (tmp_path / "pneuforce.hex").read_bytes() == HEX.read_bytes(), "run `make firmware`"


@pytest.mark.parametrize("limit", ["MOST_FLASH=9000", "MOST_RAM=1000"])
def test_make_firmware_fails_where_the_program_would_not_fit(tmp_path, limit):
    command = ["make", "firmware", *into(tmp_path), limit]
    assert subprocess.run(command, cwd=ROOT, capture_output=True, check=False).returncode != 0
    assert list(tmp_path.iterdir()) == []


def test_no_memory_is_taken_at_run_time_and_nothing_waits(tmp_path):
    run("make", "firmware", *into(tmp_path))
    names = run("avr-nm", f"{tmp_path}/pneuforce.elf").split()
    assert not {"malloc", "free", "delay", "_delay_ms"} & set(names)


def test_the_valves_pins_are_driven_in_one_place():
    source = SKETCH.read_text(encoding="utf-8")
    assert len(re.findall(r"PORTD\s*[|&^]?=[^=]", source)) == 1
    assert len(re.findall(r"DDRD\s*[|&^]?=[^=]", source)) == 1
    assert "PORTD" not in "".join(p.read_text(encoding="utf-8") for p in SKETCH.parent.glob("*.h"))


@needs("arduino-core-avr", CORE)
def test_it_builds_with_the_arduino_core_too(tmp_path):
    core, variant = CORE / "cores/arduino", CORE / "variants/standard"
    usual = ["-mmcu=atmega328p", "-DF_CPU=16000000UL", "-DARDUINO=10819", "-DARDUINO_ARCH_AVR", "-Os"]
    # The core wants DECIMAL_DIG, which this compiler has under another name only.
    usual += ["-DDECIMAL_DIG=__DECIMAL_DIG__", "-ffunction-sections", "-Wl,--gc-sections"]
    usual += ["-I", core, "-I", variant]
    parts = []
    for number, source in enumerate(("main.cpp", "wiring.c", "hooks.c", "abi.cpp")):
        parts.append(tmp_path / f"{number}.o")
        cpp = ["-std=gnu++11"] if source.endswith("cpp") else []
        run("avr-gcc", *usual, *cpp, "-c", core / source, "-o", parts[-1])
    sketch = ["-std=gnu++11", "-fpermissive", "-Wall", "-include", "Arduino.h", "-x", "c++", SKETCH]
    run("avr-g++", *usual, *sketch, "-x", "none", *parts, "-o", tmp_path / "arduino.elf")


def hanging(tmp_path, reset_flags):
    """A board whose main loop hangs 6 s after it has booted."""
    for header in SKETCH.parent.glob("*.h"):
        (tmp_path / header.name).write_bytes(header.read_bytes())
    source = SKETCH.read_text(encoding="utf-8")
    sketch = tmp_path / SKETCH.name
    hung = source.replace("    show();\n", "    show();\n    while (now_us > 6000000ul);\n", 1)
    assert hung != source
    sketch.write_text(hung.replace("reset_flags = MCUSR;", f"reset_flags = {reset_flags};"))
    program = tmp_path / "hanging.elf"
    run("avr-gcc", "@firmware/flags", "-x", "c", sketch, "-o", program)
    board = AvrBoard()
    board.chip = Emulator(program)
    return board


@emulated
@pytest.mark.parametrize("reset_flags", ["MCUSR", "0"], ids=["as reset", "cleared by a bootloader"])
def test_a_main_loop_that_hangs_is_vented_within_40_ms_and_reset_and_tells_it(tmp_path, reset_flags):
    bench = Bench(hanging(tmp_path, reset_flags))
    bench.greet().run(0.1).tell(vent()).until_state(BoardState.VENTED, 3)
    bench.tell(hold()).until_state(BoardState.HOLDING, 5)
    bench.until(lambda: bench.now_us >= 6_010_000, 5)
    assert bench.board.valves == Valve.VENT_CLOSED
    heard = len(bench.frames)
    bench.run(0.04)
    assert bench.board.valves == Valve.NONE
    bench.run(0.1)
    assert bench.board.chip.resets
    bench.greet().run(0.1)
    after = [f.message for f in bench.frames[heard:] if isinstance(f.message, Sample)]
    assert after[-1].state == BoardState.TRIPPED
    assert after[-1].faults == 1 << Fault.WATCHDOG
