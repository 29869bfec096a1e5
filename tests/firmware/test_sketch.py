"""Tests of the flashed binary: size, identity with the sketch, and build with the Arduino core."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from pneuforce.protocol.firmware_images import IMAGES
from pneuforce.sim.avr.toolchain import HEX, SKETCH
from pneuforce.sim.board import image_table
from pneuforce.sim.board.board import FIRMWARE_REVISION
from pneuforce.sim.board.image_table import crc_of
from tests.firmware.altered import ROOT, run
from tests.tools import needs

CORE = Path("/usr/share/arduino/hardware/arduino/avr")
#: Version of avr-gcc in Debian 12. Another version compiles the same source to a different binary.
RELEASE_COMPILER = "5.4.0"

pytestmark = needs("gcc-avr", "/usr/bin/avr-gcc")


def output_in(folder):
    return f"ELF={folder}/pneuforce.elf", f"HEX={folder}/pneuforce.hex", f"IMAGES={folder}/images.py"


def compiler():
    """Return the version of avr-gcc, or an empty string if it is missing."""
    return run("avr-gcc", "-dumpversion").strip() if shutil.which("avr-gcc") else ""


def test_make_firmware_builds_without_a_warning_and_prints_the_size(tmp_path):
    output = run("make", "firmware", *output_in(tmp_path))
    assert re.search(r"\d+ bytes of flash \(limit 30720\), \d+ of RAM", output)


@pytest.mark.skipif(
    compiler() != RELEASE_COMPILER, reason=f"the committed program was made by avr-gcc {RELEASE_COMPILER}"
)
def test_the_committed_program_is_the_compiled_sketch(tmp_path):
    run("make", "firmware", *output_in(tmp_path))
    assert (tmp_path / "pneuforce.hex").read_bytes() == HEX.read_bytes(), "run `make firmware`"


def test_the_table_of_released_images_contains_the_committed_program(tmp_path):
    assert IMAGES[FIRMWARE_REVISION] == crc_of(HEX), "run `make firmware`"
    assert max(IMAGES) == FIRMWARE_REVISION
    table = tmp_path / "images.py"
    image_table.main(str(HEX), str(table))
    assert table.read_bytes() == (ROOT / "protocol/firmware_images.py").read_bytes()


def test_a_hex_file_with_a_gap_has_no_crc(tmp_path):
    gap = tmp_path / "gap.hex"
    gap.write_text("".join(HEX.read_text().splitlines(keepends=True)[1:]))
    with pytest.raises(ValueError, match="the bytes before address 0010h are missing"):
        crc_of(gap)


@pytest.mark.parametrize("limit", ["MAX_FLASH=9000", "MAX_RAM=1000"])
def test_make_firmware_fails_if_the_program_does_not_fit(tmp_path, limit):
    command = ["make", "firmware", *output_in(tmp_path), limit]
    assert subprocess.run(command, cwd=ROOT, capture_output=True, check=False).returncode != 0
    assert list(tmp_path.iterdir()) == []


def test_the_program_allocates_no_memory_and_has_no_delays(tmp_path):
    run("make", "firmware", *output_in(tmp_path))
    names = run("avr-nm", f"{tmp_path}/pneuforce.elf").split()
    assert not {"malloc", "free", "delay", "_delay_ms"} & set(names)


def test_the_pins_of_the_valves_are_driven_in_one_place():
    source = SKETCH.read_text(encoding="utf-8")
    assert len(re.findall(r"PORTD\s*[|&^]?=[^=]", source)) == 1
    assert len(re.findall(r"DDRD\s*[|&^]?=[^=]", source)) == 1
    assert "PORTD" not in "".join(p.read_text(encoding="utf-8") for p in SKETCH.parent.glob("*.h"))


@needs("arduino-core-avr", CORE)
def test_the_sketch_builds_with_the_arduino_core_too(tmp_path):
    core, variant = CORE / "cores/arduino", CORE / "variants/standard"
    options = ["-mmcu=atmega328p", "-DF_CPU=16000000UL", "-DARDUINO=10819", "-DARDUINO_ARCH_AVR", "-Os"]
    # The core needs DECIMAL_DIG, which this compiler defines only under another name.
    options += ["-DDECIMAL_DIG=__DECIMAL_DIG__", "-ffunction-sections", "-Wl,--gc-sections"]
    options += ["-I", core, "-I", variant]
    parts = []
    for number, source in enumerate(("main.cpp", "wiring.c", "hooks.c", "abi.cpp")):
        parts.append(tmp_path / f"{number}.o")
        cpp = ["-std=gnu++11"] if source.endswith("cpp") else []
        run("avr-gcc", *options, *cpp, "-c", core / source, "-o", parts[-1])
    sketch = ["-std=gnu++11", "-fpermissive", "-Wall", "-include", "Arduino.h", "-x", "c++", SKETCH]
    run("avr-g++", *options, *sketch, "-x", "none", *parts, "-o", tmp_path / "arduino.elf")
