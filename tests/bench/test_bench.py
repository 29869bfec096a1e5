"""Tests that each benchmark still works. They check no figure."""

import subprocess
import sys

import pytest

from tests.bench.__main__ import BENCHMARKS
from tests.tools import needs

NEEDS = {
    "board": needs("gcc-avr", "/usr/bin/avr-gcc"),
    "mqtt": needs("mosquitto", "/usr/sbin/mosquitto"),
    "modbus": needs("libmodbus-dev", "/usr/include/modbus/modbus.h"),
}


@pytest.mark.parametrize("name", [pytest.param(name, marks=NEEDS.get(name, ())) for name in BENCHMARKS])
def test_a_benchmark_runs_and_prints_figures(name):
    done = subprocess.run(
        [sys.executable, "-m", "tests.bench", "--brief", name],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert any(character.isdigit() for character in done.stdout)
