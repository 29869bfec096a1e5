"""Fixtures and helpers for CAN tests: a hub in a separate process, and a wait with a deadline."""

import json
import subprocess
import sys
import time
from contextlib import contextmanager

import pytest


def wait_for(condition, deadline_s=15.0):
    """Wait until `condition()` is true; fail after the deadline."""
    until_s = time.monotonic() + deadline_s
    while not condition():
        assert time.monotonic() < until_s, "the condition was not met in time"
        time.sleep(0.002)


@contextmanager
def hub_process(port=0):
    """Yield the port and the process of a hub; stop the hub with SIGTERM."""
    hub = subprocess.Popen(
        [sys.executable, "-m", "pneuforce.registers.can.hub", "--port", str(port)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        yield json.loads(hub.stdout.readline())["port"], hub
    finally:
        hub.terminate()
        _, errors = hub.communicate(timeout=60)
    assert (hub.returncode, errors) == (0, "")


@pytest.fixture(scope="module")
def hub_port():
    with hub_process() as (port, _):
        yield port


@pytest.fixture
def no_frame_expiry(monkeypatch):
    """Raise the maximum age of queued frames, because frames wait longer on a busy machine.

    test_transmit_queue.py tests the maximum age.
    """
    monkeypatch.setattr("pneuforce.registers.can.transmit_queue.MAX_AGE_S", 30.0)
