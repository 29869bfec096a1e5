"""Tests of a trip after the last measurement of a hold, and before its vent."""

import threading

import pytest

from pneuforce.client.details import Details, fault_named
from pneuforce.client.measurement import Measurement, State, Status
from pneuforce.client.sensor import ForceSensor
from pneuforce.errors import Tripped
from pneuforce.instrument.cli.operate.hold import _held
from pneuforce.instrument.cli.terminal.exit_codes import ExitCode, exit_code_of
from pneuforce.registers.codes import FAULTS


class TripsBeforeTheVent:
    """Connection to an instrument whose lease expires just before the vent at the end of the hold.

    The first `late` measurements after the vent still show the held balloon.
    """

    def __init__(self, late=0):
        self.late, self.state, self.is_over = late, State.VENTED, False

    def prepare_hold(self, lease_s):
        self.state = State.VENTED

    def begin_hold(self, request):
        self.state = State.HOLDING

    def renew_lease(self, lease_s):
        pass

    def end_hold(self):
        self.is_over = True

    def read(self):
        if self.is_over:
            self.state = State.TRIPPED if self.late < 1 else self.state
            self.late -= 1
        status = {Status.OUT_OF_RANGE} if self.state is State.HOLDING else {Status.VENTED}
        return Measurement(pressure_kpa=0.0, state=self.state, status_or_none=frozenset(status))

    def first_out_fault(self):
        return FAULTS.codes["lease_expired"]

    def details(self):
        return Details(first_out_fault=fault_named("lease_expired"))


def test_the_end_of_a_hold_reports_the_trip():
    sensor = ForceSensor("tcp://127.0.0.1", TripsBeforeTheVent())
    with pytest.raises(Tripped, match="lease_expired"), sensor.hold(8.0):
        pass


@pytest.mark.parametrize("late", [0, 1])
def test_the_command_reports_the_trip_and_the_verified_vent(late):
    sensor = ForceSensor("tcp://127.0.0.1", TripsBeforeTheVent(late))
    stop = threading.Event()
    stop.set()
    with pytest.raises(Tripped, match="lease_expired") as caught:
        _held(sensor, sensor.hold(8.0), stop, None, True)
    assert exit_code_of(caught.value) is ExitCode.HOLD_ENDED
    assert any("Vented" in note for note in caught.value.__notes__)
