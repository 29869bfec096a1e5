"""Waiting for conditions instead of fixed times. Benchmarks use this module without pytest."""

import time


def wait_for(read, condition, deadline_s=30.0):
    """Call `read()` until `condition(value)` is true. Return the value."""
    until_s = time.monotonic() + deadline_s
    while not condition(value := read()):
        if time.monotonic() > until_s:
            raise AssertionError(f"the condition is not true after {deadline_s} s: {value}")
        time.sleep(0.02)
    return value


def start_inflation(plc, setpoint_kpa):
    """Command the inflation after the start of the instrument."""
    wait_for(plc.read, lambda v: "not_zeroed" not in v["status"] and "vented" in v["status"])
    plc.write("mode", "vent")
    plc.write("setpoint_requested", setpoint_kpa)
    plc.write("mode", "hold")


def inflate(plc, setpoint_kpa):
    """Inflate after the start of the instrument. Return the registers of the held balloon."""
    start_inflation(plc, setpoint_kpa)
    return wait_for(plc.read, lambda v: v["state"] == "holding")
