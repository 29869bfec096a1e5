"""The sketch as it is flashed: it fits, it is what was released, it builds as the Arduino IDE would."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from sim.avr.toolchain import HEX, SKETCH
from tests.firmware.altered import ROOT, run
from tests.tools import needs

CORE = Path("/usr/share/arduino/hardware/arduino/avr")
#: Debian 12. Another version makes other bytes of the same source.
RELEASED_BY = "5.4.0"

pytestmark = needs("gcc-avr", "/usr/bin/avr-gcc")


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
