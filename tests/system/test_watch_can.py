"""Tests of `pneuforce watch can` with a sender that loses frames and then stops."""

import os
import re
import subprocess
import sys
import time
from contextlib import contextmanager

import can
import pytest

from pneuforce.instrument.cli.terminal.exit_codes import ExitCode
from pneuforce.teststand.child_process import ChildProcess
from tests.command_runner import pneuforce
from tests.system.waiting import wait_for


@pytest.fixture
def hub():
    with ChildProcess("hub", ["pneuforce.registers.can.hub", "--port", "0"]) as started:
        yield started.ready()["port"]


@contextmanager
def watching(port, **options):
    command = [sys.executable, "-m", "pneuforce", "watch", "can", "--port", str(port)]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, **options) as process:
        try:
            yield process
        finally:
            process.kill()


def send_until(port, counters, seen):
    """Send Force frames with these counters repeatedly, because the watching process may not be ready yet."""
    with can.Bus("can0", "socketcand", host="127.0.0.1", port=port, tcp_tune=True) as bus:
        until_s = time.monotonic() + 15.0
        while not seen():
            assert time.monotonic() < until_s
            for counter in counters:
                data = bytes((0x00, 0x00, 0x40, 0x1F, 0x93, 0x00, 0xC2, counter))
                bus.send(can.Message(arbitration_id=0x185, data=data, is_extended_id=False))
            time.sleep(0.05)


def test_lines_report_lost_frames_and_silence(hub, tmp_path):
    output = tmp_path / "output"
    with output.open("w") as stdout, watching(hub, stdout=stdout) as process:
        send_until(hub, (1, 2, 5), lambda: "counter 5" in output.read_text())
        assert process.stderr.readline().startswith("pneuforce: no frame from node 5 for 1.5 s: check")
    lines = output.read_text().splitlines()
    assert all(line.endswith("  (2 lost before)") for line in lines if "counter 5" in line)
    assert all("lost" not in line for line in lines if "counter 2" in line)


def test_without_frames_one_warning_is_printed_and_the_exit_code_is_that_of_a_missing_instrument(hub):
    done = pneuforce("watch", "can", "--port", hub, "--seconds", "3.5")
    assert done.returncode == ExitCode.UNAVAILABLE
    warning, error = done.stderr.splitlines()
    assert "for 1.5 s" in warning
    assert "no frame from node 5 has arrived" in error


def test_on_a_terminal_the_age_of_a_missing_frame_increases(hub):
    terminal, inner = os.openpty()
    shown = bytearray()

    def table_contains(text):
        shown.extend(os.read(terminal, 65536))
        return text in re.sub(rb"\x1b\[[0-9;?]*[a-zA-Z]", b"", bytes(shown)).decode(errors="replace")

    with watching(hub, stdout=inner, env={**os.environ, "COLUMNS": "120", "LINES": "40", "TERM": "xterm"}):
        send_until(hub, (1, 2, 5), lambda: table_contains("force_uncertainty"))
        shown.clear()
        wait_for(lambda: table_contains("1.6"), bool)
        table = re.sub(rb"\x1b\[[0-9;?]*[a-zA-Z]", b"", bytes(shown)).decode(errors="replace")
    ages = [float(age) for age in re.findall(r"Force +\d+ +(\d+\.\d\d) s", table)]
    assert ages == sorted(ages)
    assert ages[-1] > 1.5
