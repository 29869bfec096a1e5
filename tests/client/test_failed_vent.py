"""Tests of a vent that the instrument reports as failed."""

import pytest

from pneuforce.client.details import VENT_FAULTS, Details, fault_named
from pneuforce.client.measurement import Measurement, State, Status
from pneuforce.client.sensor import ForceSensor
from pneuforce.errors import ConfigurationError, VentFailed, VentNotConfirmed
from pneuforce.instrument.cli.terminal.failure import failure_values
from pneuforce.instrument.core.faults import STATUS_OF
from pneuforce.registers.codes import FAULTS


class BlockedTube:
    """Connection to an instrument that reports a blocked tube after the second reading."""

    def __init__(self, fault):
        self.fault, self.reads = fault, 0

    def read(self):
        self.reads += 1
        status = {Status.VENT_FAULT, Status.VENTED} if self.reads > 2 else set()
        return Measurement(pressure_kpa=0.0, status_or_none=frozenset(status))

    def first_out_fault(self):
        return FAULTS.codes[self.fault]


def test_the_vent_faults_are_those_of_the_instrument():
    assert {FAULTS.names[code] for code, bit in STATUS_OF.items() if bit == "vent_fault"} == VENT_FAULTS


def test_an_earlier_fault_with_another_cause_is_not_named():
    with pytest.raises(VentFailed, match="the tube") as caught:
        ForceSensor("tcp://127.0.0.1", BlockedTube("lease_expired")).wait_until_vented(60.0)
    assert failure_values(caught.value)["fault"] is None
    assert "lease" not in str(caught.value)


@pytest.mark.parametrize("fault", sorted(VENT_FAULTS))
def test_a_failed_vent_is_reported_at_once_with_its_fault_and_remedy(fault):
    connection = BlockedTube(fault)
    with pytest.raises(VentFailed, match="FAILED") as caught:
        ForceSensor("tcp://127.0.0.1", connection).wait_until_vented(60.0)
    assert connection.reads == 3
    values = failure_values(caught.value)
    assert (values["code"], values["fault"]["name"]) == ("vent_not_confirmed", fault)
    assert values["remedy"] == values["fault"]["remedy"]
    assert "inflated" in values["message"]


class LinkLost:
    """Connection to an instrument that receives no samples, so that no vent can be verified."""

    def read(self):
        return Measurement(state=State.TRIPPED, status_or_none=frozenset({Status.LINK_LOST}))

    def details(self):
        """Return the details as over CAN, without the other faults."""
        return Details(first_out_fault=fault_named("link_lost"))


def test_a_vent_of_a_tripped_rig_that_is_not_verified_names_the_trip_and_its_remedy():
    with pytest.raises(VentNotConfirmed, match=r"rig\. The rig has tripped \(link_lost\): ") as caught:
        ForceSensor("tcp://127.0.0.1", LinkLost()).wait_until_vented(0.01)
    assert not isinstance(caught.value, VentFailed)
    values = failure_values(caught.value)
    assert (values["code"], values["fault"]["name"]) == ("vent_not_confirmed", "link_lost")
    assert values["remedy"] in values["message"]


class Held:
    """Connection to an instrument that holds the balloon, because no vent was sent."""

    def read(self):
        return Measurement(state=State.HOLDING, pressure_kpa=6.0, status_or_none=frozenset())

    def details(self):
        return Details()


def test_a_wait_without_a_vent_says_that_the_balloon_is_inflated():
    with pytest.raises(VentNotConfirmed, match=r"still inflated at 6\.00 kPa\. Send a vent\."):
        ForceSensor("tcp://127.0.0.1", Held()).wait_until_vented(0.01)


@pytest.mark.parametrize("timeout_s", [-1, float("nan"), "1"])
def test_an_invalid_timeout_of_the_wait_is_rejected(timeout_s):
    with pytest.raises(ConfigurationError, match="timeout_s"):
        ForceSensor("tcp://127.0.0.1", Held()).wait_until_vented(timeout_s)


class NotZeroed:
    """Connection to an instrument without a zero adjustment, with the fault `fault` or without a fault."""

    def __init__(self, fault):
        self.fault = fault

    def read(self):
        return Measurement(pressure_kpa=0.25, status_or_none=frozenset({Status.NOT_ZEROED}))

    def details(self):
        return Details(first_out_fault=fault_named(self.fault) if self.fault else None)


def test_a_vent_without_a_zero_names_the_fault_that_prevents_the_zero():
    with pytest.raises(VentNotConfirmed, match=r"because the fault host_silent is latched") as caught:
        ForceSensor("tcp://127.0.0.1", NotZeroed("host_silent")).wait_until_vented(0.01)
    assert failure_values(caught.value)["fault"]["name"] == "host_silent"


def test_a_vent_without_a_zero_and_without_a_fault_names_the_missing_zero():
    with pytest.raises(VentNotConfirmed, match=r"the sensor has no zero adjustment \(.*0\.25 kPa\)"):
        ForceSensor("tcp://127.0.0.1", NotZeroed("")).wait_until_vented(0.01)
