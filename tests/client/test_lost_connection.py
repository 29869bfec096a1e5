"""Tests of a hold and of a stream whose connection is lost for a time."""

import threading
import time
from itertools import islice

import pytest

from pneuforce.client.measurement import Measurement, State
from pneuforce.client.modbus_connection import ModbusSensorConnection
from pneuforce.client.sensor import ForceSensor
from pneuforce.errors import ConnectionLost, HoldEnded, Tripped
from pneuforce.instrument.cli.terminal.failure import failure_text
from pneuforce.registers.codes import FAULTS
from pneuforce.registers.map_hash import MAP_HASH
from pneuforce.registers.modbus.client import ModbusClientError

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


class RestartedInstrument:
    """Modbus instrument that can disappear. After its restart, the rig is vented."""

    def __init__(self):
        self.runs, self.state, self.counter, self.written = True, "vented", 0, []
        self.map_hash = MAP_HASH

    def open(self):
        self.check()
        return self

    def close(self):
        pass

    __enter__ = open

    def __exit__(self, *_):
        pass

    def check(self):
        if not self.runs:
            raise ModbusClientError("no Modbus TCP server answers")

    def restart(self):
        self.runs, self.state, self.counter, self.written = True, "boot", 0, []

    def read_block(self, addresses):
        self.check()
        self.counter += 1
        measured = dict.fromkeys(("force", "force_uncertainty", "pressure", "radius", "setpoint"), 0.0)
        state = {"state": self.state, "status": (), "sample_counter": self.counter, "sample_age": 0.0}
        return measured | state | {"map_hash": self.map_hash, "first_out_fault": 0}

    def write(self, name, value):
        self.check()
        self.written.append((name, value))
        self.state = "holding" if (name, value) == ("mode", "hold") else self.state

    def vent(self):
        self.check()
        self.state = "vented"


@pytest.fixture
def modbus():
    """Return an instrument that can disappear, and a sensor that is connected over Modbus."""
    instrument = RestartedInstrument()
    connection = ModbusSensorConnection("tcp://127.0.0.1", instrument.open, silence_s=0.1)
    return instrument, ForceSensor("tcp://127.0.0.1", connection)


def test_a_modbus_stream_is_invalid_during_a_restart_of_the_instrument_and_then_continues(modbus):
    instrument, sensor = modbus
    stream = sensor.stream(timeout_s=60.0)
    assert any(measurement.valid for measurement in stream)
    instrument.runs = False
    assert any(measurement.sample_counter is None for measurement in islice(stream, 3))
    instrument.restart()
    assert any(measurement.valid for measurement in stream)


def test_a_modbus_stream_raises_after_its_timeout_with_the_reason(modbus):
    instrument, sensor = modbus
    stream, yielded = sensor.stream(timeout_s=1.0), []
    yielded.append(next(stream))
    instrument.runs = False
    with pytest.raises(
        ConnectionLost, match=r"no new sample arrived over .* for 1 s; .*no Modbus TCP server"
    ):
        yielded.extend(stream)
    assert not yielded[-1].valid


def test_a_restart_of_the_instrument_ends_a_hold_without_another_lease_or_inflation(modbus):
    instrument, sensor = modbus

    def hold_during_a_restart():
        with sensor.hold(5.0, lease_s=60.0):
            stream = sensor.stream(timeout_s=60.0)
            assert any(measurement.valid for measurement in stream)
            instrument.runs = False
            assert any(measurement.sample_counter is None for measurement in islice(stream, 3))
            instrument.restart()
            list(stream)

    with pytest.raises(HoldEnded):
        hold_during_a_restart()
    assert ("mode", "hold") not in instrument.written
    assert [value for name, value in instrument.written if name == "lease"] == [0.0]


def test_after_an_upgrade_of_the_instrument_no_value_is_read_but_a_vent_is_sent(modbus):
    instrument, sensor = modbus
    instrument.runs = False
    with pytest.raises(ConnectionLost):
        sensor.read()
    instrument.restart()
    instrument.map_hash = MAP_HASH + 1
    with pytest.raises(ConnectionLost, match="another version of the register map"):
        sensor.read()
    sensor.vent()
    assert instrument.state == "vented"
