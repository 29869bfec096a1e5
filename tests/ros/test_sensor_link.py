"""Tests of the connection and the commands of the ROS 2 node with a running instrument, without ROS."""

import threading
import time
from contextlib import contextmanager

import pytest
from pneuforce_ros.sensor_link import VENT_PRIORITY_S, CommandRejected, SensorLink

import pneuforce
from tests.system.waiting import wait_for

SETPOINT_KPA, LEASE_S = 6.0, 1.0


@contextmanager
def connected(url):
    """Run a link, with the list of the received measurements and of the errors."""
    measurements, errors = [], []
    link = SensorLink(url, measurements.append, errors.append, errors.append)
    link.start()
    try:
        wait_for(lambda: measurements or errors, bool)
        yield link, measurements, errors
    finally:
        link.close()


def in_thread(command, *arguments):
    """Run a command in a thread. Return the thread, and the list that receives its error, or None."""
    results = []

    def run():
        try:
            results.append(command(*arguments))
        except pneuforce.PneuforceError as error:
            results.append(error)

    thread = threading.Thread(target=run)
    thread.start()
    return thread, results


def test_a_vent_ends_a_hold_at_any_time(pneuforce_rig):
    with connected(pneuforce_rig.url) as (link, _, _):
        for wait_s in (0.0, 0.05, 0.3):
            pneuforce_rig.wait_for(lambda registers: registers["state"] == "vented")
            thread, results = in_thread(link.hold, SETPOINT_KPA, LEASE_S)
            time.sleep(wait_s)
            begun_s = time.monotonic()
            link.vent()
            assert time.monotonic() - begun_s < 1.0
            thread.join(5.0)
            assert isinstance(results[0], pneuforce.PneuforceError)
            with pytest.raises(CommandRejected):  # the order of a hold and a vent can be changed on the way
                link.hold(SETPOINT_KPA, LEASE_S)
            time.sleep(VENT_PRIORITY_S)
            assert pneuforce_rig.read()["state"] in ("venting", "vented")


def test_the_end_vents_the_held_balloon_and_ends_the_lease(pneuforce_rig):
    with connected(pneuforce_rig.url) as (link, measurements, _):
        link.hold(SETPOINT_KPA, LEASE_S)
        wait_for(lambda: measurements[-1].valid, bool)
        with pytest.raises(CommandRejected):
            link.hold(SETPOINT_KPA, LEASE_S)
        time.sleep(1.5 * LEASE_S)
        assert pneuforce_rig.read()["state"] == "holding"
    registers = pneuforce_rig.wait_for(lambda registers: registers["state"] == "vented")
    assert (registers["lease_left"], registers["first_out_fault"]) == (0, 0)


def test_without_an_instrument_each_command_fails_at_once():
    with connected("tcp://127.0.0.1:1") as (link, measurements, errors):
        for command in (link.vent, link.clear, lambda: link.hold(SETPOINT_KPA, LEASE_S)):
            with pytest.raises(pneuforce.PneuforceError):
                command()
        assert errors
        assert not measurements
