"""Tests of a vent that cannot be verified: the command names the fault that prevents it, and its remedy."""

import pytest

from pneuforce.client.details import Details, fault_named
from pneuforce.client.failed_vent import PREVENTING_FAULTS
from pneuforce.client.measurement import Measurement, State, Status
from pneuforce.client.sensor import ForceSensor
from pneuforce.errors import VentNotConfirmed
from pneuforce.instrument.cli.operate.confirmed_vent import confirmed_vent
from pneuforce.instrument.cli.terminal.failure import failure_values
from pneuforce.instrument.core.faults import STATUS_OF, HostFault
from pneuforce.registers.codes import FAULTS


class Connection:
    """Connection to an instrument with latched faults."""

    def __init__(self, *faults, status=frozenset()):
        self._details = Details(latched_faults=tuple(map(fault_named, faults)))
        self._status = frozenset(status)

    def read(self):
        return Measurement(pressure_kpa=0.1, state=State.TRIPPED, status_or_none=self._status)

    def details(self):
        return self._details


def waited(*faults, **values):
    return ForceSensor("tcp://127.0.0.1", Connection(*faults, **values)).wait_until_vented(0.0)


def test_the_preventing_faults_are_those_of_the_sensor_and_the_link():
    of_sensor = {FAULTS.names[code] for code, bit in STATUS_OF.items() if bit == "sensor_fault"}
    assert of_sensor | {FAULTS.names[HostFault.LINK_LOST]} == PREVENTING_FAULTS


@pytest.mark.parametrize("fault", sorted(PREVENTING_FAULTS))
def test_the_fault_that_prevents_the_verification_is_named_with_its_remedy(fault):
    with pytest.raises(VentNotConfirmed, match=r"not( be)? verified,? because") as caught:
        waited("lease_expired", fault)
    values = failure_values(caught.value)
    assert (values["code"], values["fault"]["name"]) == ("vent_not_confirmed", fault)
    assert values["remedy"] == values["fault"]["remedy"]
    assert values["remedy"] in values["message"]


def test_a_fault_that_does_not_prevent_the_verification_is_not_named():
    with pytest.raises(VentNotConfirmed, match="stop switch") as caught:
        waited("lease_expired")
    assert failure_values(caught.value)["fault"] is None


def test_a_verified_vent_is_confirmed_and_still_asks_to_look_at_the_balloon():
    connection = Connection(status={Status.VENTED})
    assert "Look at the balloon" in confirmed_vent(ForceSensor("tcp://127.0.0.1", connection))
