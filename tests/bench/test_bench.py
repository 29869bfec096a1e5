"""Tests that each benchmark still works. They check no figure."""

import os
from unittest.mock import patch

import pytest

from tests.bench.__main__ import BENCHMARKS
from tests.tools import needs

NEEDS = {
    "board": needs("gcc-avr", "/usr/bin/avr-gcc"),
    "mqtt": needs("mosquitto", "/usr/sbin/mosquitto"),
    "modbus": needs("libmodbus-dev", "/usr/include/modbus/modbus.h"),
}


@pytest.mark.parametrize("name", [pytest.param(name, marks=NEEDS.get(name, ())) for name in BENCHMARKS])
def test_a_benchmark_runs_and_prints_figures(name, capfd):
    with patch.dict(os.environ):  # some benchmarks set PYTHONPATH for their processes
        BENCHMARKS[name](brief=True)
    assert any(character.isdigit() for character in capfd.readouterr().out)
