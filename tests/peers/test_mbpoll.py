"""Tests of the TCP server with the program mbpoll from Debian."""

import subprocess

import pytest

from tests.registers.modbus.memory_source import MemorySource
from tests.registers.modbus.serving import serving
from tests.tools import needs

pytestmark = needs("mbpoll")


@pytest.fixture
def source():
    return MemorySource()


@pytest.fixture
def mbpoll(source):
    def run(arguments, *values):
        options = ["-m", "tcp", "-p", str(server.port), "-0", "-1", *arguments.split()]
        command = ["mbpoll", *options, "127.0.0.1", *map(str, values)]
        return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)

    with serving(source) as server:
        yield run


def test_mbpoll_sets_the_pressure(mbpoll, source):
    done = mbpoll("-B -t 4:float -r 512", "8.0")
    assert done.returncode == 0, done.stderr
    assert "Written 1 references." in done.stdout
    assert source.values["setpoint_requested_kpa"] == 8.0


@pytest.mark.parametrize(("order", "value"), [("", "8.0"), ("-B", "12.5"), ("-B", "1.99"), ("-B", "nan")])
def test_swapped_words_and_values_out_of_range_are_rejected(mbpoll, source, order, value):
    done = mbpoll(f"{order} -t 4:float -r 512", value)
    assert done.returncode != 0
    assert "Illegal data value" in done.stderr
    assert source.write_requests == []


def test_mbpoll_reads_force_and_test_pattern(mbpoll):
    assert "[0]: \t1.25\n" in mbpoll("-B -t 3:float -r 0 -c 10").stdout
    assert "[3840]: \t-123.45\n" in mbpoll("-B -t 4:float -r 3840").stdout


def test_mbpoll_reads_a_status_bit(mbpoll):
    assert "[3]: \t1\n" in mbpoll("-t 1 -r 0 -c 32").stdout


def test_mbpoll_holds_and_vents(mbpoll, source):
    assert mbpoll("-t 4 -r 516", "1").returncode == 0
    assert source.values["mode"] == "hold"
    assert mbpoll("-t 4 -r 516", "0").returncode == 0
    assert source.values["mode"] == "vent"


def test_mbpoll_reports_registers_that_do_not_exist(mbpoll):
    assert "Illegal data address" in mbpoll("-t 4 -r 200").stderr
    assert "Illegal data address" in mbpoll("-t 0 -r 0").stderr
