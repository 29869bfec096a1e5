"""Tests of commands whose output is a pipe without a reader, as after `| head -1`."""

import errno
import io
import os
import subprocess
import sys

import can
import pytest

from pneuforce.errors import WriteFailed
from pneuforce.instrument.cli.terminal.exit_codes import ExitCode, exit_code_of
from pneuforce.instrument.cli.terminal.output import print_done
from pneuforce.instrument.cli.watch.watch_can import watch_can
from pneuforce.registers.can.bus import CanAddress
from pneuforce.registers.can.frames import HEARTBEAT, encode
from pneuforce.teststand.observer import CanNodeAddress


def run_without_reader(*words):
    """Run a command whose first write to stdout fails. Return its exit code and stderr."""
    unread, written = os.pipe()
    os.close(unread)
    command = [sys.executable, "-m", "pneuforce", *map(str, words)]
    with os.fdopen(written, "w") as stdout:
        done = subprocess.run(
            command, stdout=stdout, stderr=subprocess.PIPE, text=True, timeout=600, check=False
        )
    return done.returncode, done.stderr


@pytest.mark.parametrize(
    ("words", "code"),
    [
        (("vent", "--port", "1"), ExitCode.UNAVAILABLE),
        (("frob",), ExitCode.USAGE),
        (("estimate", "--dpi", "8"), ExitCode.USAGE),
        (("config", "--check", "/none.toml"), ExitCode.CONFIGURATION),
    ],
)
def test_the_exit_code_is_the_same_if_the_message_cannot_be_written(words, code):
    with open("/dev/full", "w", encoding="ascii") as full:
        command = [sys.executable, "-m", "pneuforce", *words]
        done = subprocess.run(command, stdout=full, stderr=full, timeout=600, check=False)
    assert done.returncode == code


@pytest.mark.parametrize(
    ("words", "closed", "code"),
    [
        ("map", ">&-", ExitCode.DONE),
        ("sim run --list --json", ">&-", ExitCode.DONE),
        ("frob", ">&-", ExitCode.USAGE),
        ("vent --port 1", ">&-", ExitCode.UNAVAILABLE),
        ("vent --port 1", "2>&-", ExitCode.UNAVAILABLE),
        ("map", "<&- >&- 2>&-", ExitCode.DONE),
        ("config --check /none.toml", "<&- >&- 2>&-", ExitCode.CONFIGURATION),
    ],
)
def test_a_closed_stream_is_used_like_the_null_device(words, closed, code):
    done = subprocess.run(
        ["sh", "-c", f"exec {sys.executable} -m pneuforce {words} {closed}"],
        stderr=subprocess.PIPE,
        text=True,
        timeout=600,
        check=False,
    )
    assert done.returncode == code
    assert "Traceback" not in done.stderr


class FullFile(io.StringIO):
    """Output of a full disk."""

    def write(self, text):
        raise OSError(errno.ENOSPC, "No space left on device")


def test_the_result_of_a_done_command_is_on_stderr_if_stdout_is_full(monkeypatch):
    monkeypatch.setattr("sys.stdout", FullFile())
    with pytest.raises(WriteFailed, match="Vented: the sensor reads") as failed:
        print_done("Vented: the sensor reads 0.01 kPa.", as_json=False)
    assert exit_code_of(failed.value) is ExitCode.IO_ERROR


def test_watch_can_does_not_blame_the_instrument_for_a_full_output(monkeypatch):
    name = "virtual-full-output"
    with can.Bus(name, "virtual") as bus:
        beat = encode(HEARTBEAT, None, node_state="operational")
        sent = bus.send_periodic(can.Message(arbitration_id=0x705, data=beat, is_extended_id=False), 0.02)
        monkeypatch.setattr("sys.stdout", FullFile())
        with pytest.raises(OSError, match="No space left") as failed:
            watch_can(CanNodeAddress(CanAddress(interface="virtual", channel=name), 5), 5.0, True)
        sent.stop()
    assert exit_code_of(failed.value) is ExitCode.IO_ERROR


@pytest.mark.parametrize(
    "words",
    [
        ("map",),
        ("-h",),
        ("watch", "-h"),
        ("config", "--example"),
        ("files",),
        ("sim", "run", "--list"),
        ("estimate", "--dpi", "8", "--dpf", "9"),
    ],
)
def test_a_closed_output_ends_a_command_with_the_code_of_an_io_error_and_without_a_message(words):
    assert run_without_reader(*words) == (ExitCode.IO_ERROR, "")
