"""A hub as a process of its own, and the waiting that real buses need."""

import json
import subprocess
import sys
import time
from contextlib import contextmanager

import pytest


def wait_for(condition, deadline_s=15.0):
    until_s = time.monotonic() + deadline_s
    while not condition():
        assert time.monotonic() < until_s, "it did not come about in time"
        time.sleep(0.002)


@contextmanager
def hub_process(port=0):
    """A hub and its port; ended with SIGTERM."""
    hub = subprocess.Popen(
        [sys.executable, "-m", "registers.can.hub", "--port", str(port)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        yield json.loads(hub.stdout.readline())["port"], hub
    finally:
        hub.terminate()
        _, errors = hub.communicate(timeout=20)
    assert (hub.returncode, errors) == (0, "")


@pytest.fixture(scope="module")
def hub_port():
    with hub_process() as (port, _):
        yield port


@pytest.fixture
def frames_stay_fresh(monkeypatch):
    """On a busy machine too; that old ones are dropped is the outbox's own case."""
    monkeypatch.setattr("registers.can.outbox.FRESH_S", 30.0)
