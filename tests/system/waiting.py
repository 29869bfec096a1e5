"""Waiting for the world, never for a fixed time."""

import time

import pytest


def wait_for(look, wanted, deadline_s=30.0):
    """The first value of `look()` for which `wanted(value)` holds."""
    until_s = time.monotonic() + deadline_s
    while not wanted(value := look()):
        if time.monotonic() > until_s:
            pytest.fail(f"still not after {deadline_s} s: {value}")
        time.sleep(0.02)
    return value


def inflate(plc, setpoint_kpa):
    """From a start to a locked balloon."""
    wait_for(plc.read, lambda v: "not_zeroed" not in v["status"] and "vented" in v["status"])
    plc.write("mode", "vent")
    plc.write("setpoint_requested", setpoint_kpa)
    plc.write("mode", "hold")
    return wait_for(plc.read, lambda v: v["state"] == "holding")
