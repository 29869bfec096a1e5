"""`pneuforce watch can` beside a sender that loses frames, and falls silent."""

import os
import re
import subprocess
import sys
import time
from contextlib import contextmanager

import can
import pytest

from tests.system.waiting import wait_for
from teststand.children import Child


@pytest.fixture
def hub():
    with Child("hub", ["registers.can.hub", "--port", "0"]) as started:
        yield started.ready()["port"]


@contextmanager
def watching(port, **how):
    command = [sys.executable, "-m", "instrument", "watch", "can", "--port", str(port)]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, **how) as process:
        try:
            yield process
        finally:
            process.kill()


def send_until(port, counters, seen):
    """Send Force frames with these counters again and again; who watches may not be there yet."""
    with can.Bus("can0", "socketcand", host="127.0.0.1", port=port, tcp_tune=True) as bus:
        until_s = time.monotonic() + 15.0
        while not seen():
            assert time.monotonic() < until_s
            for counter in counters:
                data = bytes((0x00, 0x00, 0x40, 0x1F, 0x93, 0x00, 0xC2, counter))
                bus.send(can.Message(arbitration_id=0x185, data=data, is_extended_id=False))
            time.sleep(0.05)


def test_lines_tell_lost_frames_and_silence(hub, tmp_path):
    said = tmp_path / "said"
    with said.open("w") as stdout, watching(hub, stdout=stdout) as process:
        send_until(hub, (1, 2, 5), lambda: "counter 5" in said.read_text())
        assert process.stderr.readline() == "pneuforce: nothing from node 5 for 1.5 s\n"
    lines = said.read_text().splitlines()
    assert all(line.endswith("  (2 lost before)") for line in lines if "counter 5" in line)
    assert all("lost" not in line for line in lines if "counter 2" in line)


def test_on_a_terminal_what_stays_away_grows_old(hub):
    terminal, inner = os.openpty()
    shown = bytearray()

    def table(of):
        shown.extend(os.read(terminal, 65536))
        return of in re.sub(rb"\x1b\[[0-9;?]*[a-zA-Z]", b"", bytes(shown)).decode(errors="replace")

    with watching(hub, stdout=inner, env={**os.environ, "COLUMNS": "120", "LINES": "40", "TERM": "xterm"}):
        send_until(hub, (1, 2, 5), lambda: table("force_uncertainty"))
        shown.clear()
        wait_for(lambda: table("1.6"), bool)
        old = re.sub(rb"\x1b\[[0-9;?]*[a-zA-Z]", b"", bytes(shown)).decode(errors="replace")
    ages = [float(age) for age in re.findall(r"Force +\d+ +(\d+\.\d\d) s", old)]
    assert ages == sorted(ages)
    assert ages[-1] > 1.5
