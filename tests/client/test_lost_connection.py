"""Tests of a hold whose connection is lost for a time."""

import threading
import time

import pytest

from pneuforce.client.measurement import Measurement, State
from pneuforce.client.sensor import ForceSensor
from pneuforce.errors import ConnectionLost, Tripped
from pneuforce.instrument.cli.terminal.failure import failure_text
from pneuforce.registers.codes import FAULTS

LEASE_S = 0.2


class Interrupted:
    """Connection to an instrument that holds the balloon and can stop answering."""

    def __init__(self):
        self.state, self.lost, self.renewed = State.VENTED, False, threading.Event()

    def read(self):
        if self.lost:
            raise ConnectionLost("lost")
        return Measurement(
            force_or_nan=0.0, force_std_or_nan=0.1, state=self.state, status_or_none=frozenset()
        )

    def prepare_hold(self, lease_s):
        pass

    def begin_hold(self, request):
        self.state = State.HOLDING

    def renew_lease(self, lease_s):
        self.read()
        self.renewed.set()

    def end_hold(self):
        self.state = State.VENTED

    def first_out_fault(self):
        return FAULTS.codes["lease_expired"]


class Killed(Interrupted):
    """Connection to an instrument that is killed during the hold."""

    def end_hold(self):
        raise ConnectionLost("lost")


def lose(connection):
    """Let the connection be lost for longer than the lease."""
    connection.lost = True
    time.sleep(3 * LEASE_S)
    connection.renewed.clear()


def test_the_lease_is_renewed_again_after_a_time_without_a_connection():
    connection = Interrupted()
    sensor = ForceSensor("tcp://127.0.0.1", connection)
    with sensor.hold(5.0, lease_s=LEASE_S):
        lose(connection)
        with pytest.raises(ConnectionLost):
            sensor.read()
        connection.lost = False
        assert connection.renewed.wait(10.0)
        assert sensor.read().state is State.HOLDING


def test_a_lease_that_has_expired_meanwhile_is_reported_as_a_trip():
    connection = Interrupted()
    sensor = ForceSensor("tcp://127.0.0.1", connection)
    with sensor.hold(5.0, lease_s=LEASE_S):
        lose(connection)
        connection.state, connection.lost = State.TRIPPED, False
        with pytest.raises(Tripped, match="lease_expired"):
            sensor.read()
    assert connection.state is not State.HOLDING


def test_a_lost_connection_is_described_once_if_the_vent_cannot_be_sent_either():
    sensor = ForceSensor("tcp://127.0.0.1", Killed())
    with pytest.raises(ConnectionLost) as caught, sensor.hold(5.0):
        raise ConnectionLost("lost")
    assert failure_text(caught.value).count("lost") == 1
    assert "The vent could not be sent. If the instrument runs" in failure_text(caught.value)
