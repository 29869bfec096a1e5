"""Tests of the RTU server with the program mbpoll from Debian as master. socat connects the two ptys."""

import subprocess

import pytest

from tests.registers.modbus.memory_source import MemorySource
from tests.registers.modbus.serial_lines import serving_on
from tests.registers.modbus.serving import eventually
from tests.tools import needs

pytestmark = [needs("mbpoll"), needs("socat")]


@pytest.fixture
def ends(tmp_path):
    instrument, master = tmp_path / "instrument", tmp_path / "master"
    socat = subprocess.Popen(["socat", f"pty,raw,echo=0,link={instrument}", f"pty,raw,echo=0,link={master}"])
    try:
        assert eventually(lambda: instrument.exists() and master.exists())
        yield instrument, master
    finally:
        socat.terminate()
        socat.wait()


@pytest.fixture
def source():
    return MemorySource()


@pytest.fixture
def mbpoll(source, ends):
    def run(arguments, *values):
        options = ["-m", "rtu", "-b", "19200", "-P", "none", "-0", "-1", "-o", "0.5", *arguments.split()]
        command = ["mbpoll", *options, str(ends[1]), *map(str, values)]
        return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)

    with serving_on(ends[0], source):
        yield run


def test_mbpoll_reads_force_test_pattern_and_status(mbpoll):
    assert "[0]: \t1.25\n" in mbpoll("-B -t 3:float -r 0 -c 10").stdout
    assert "[3840]: \t-123.45\n" in mbpoll("-B -t 4:float -r 3840").stdout
    assert "[3]: \t1\n" in mbpoll("-t 1 -r 0 -c 32").stdout


def test_mbpoll_sets_the_pressure_holds_and_vents(mbpoll, source):
    assert mbpoll("-B -t 4:float -r 512", "8.0").returncode == 0
    assert source.values["setpoint_requested_kpa"] == 8.0
    for mode, name in (("1", "hold"), ("0", "vent")):
        assert mbpoll("-t 4 -r 516", mode).returncode == 0
        assert source.values["mode"] == name


def test_mbpoll_reports_the_exception_of_rejected_requests(mbpoll, source):
    assert "Illegal data value" in mbpoll("-B -t 4:float -r 512", "12.5").stderr
    assert "Illegal data address" in mbpoll("-t 4 -r 200").stderr
    assert source.write_requests == []


def test_requests_to_another_unit_time_out(mbpoll):
    assert "timed out" in mbpoll("-a 2 -t 4 -r 0").stderr
    assert mbpoll("-a 1 -t 4 -r 0").returncode == 0
