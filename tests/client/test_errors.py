"""Tests of the errors: in a pool of processes, which transmits them as pickles; the fault in a rejection."""

import copy
import pickle

import pytest

from pneuforce import errors
from pneuforce.client.details import Details, fault_of
from pneuforce.client.failed_vent import check_tube_proven, failed_vent
from pneuforce.client.rejection import rejected, with_fault
from pneuforce.registers.codes import FAULTS
from pneuforce.registers.modbus.client import WriteRejectedError


def unproven():
    with pytest.raises(errors.VentNotConfirmed) as caught:
        check_tube_proven(Details(maintenance_causes=frozenset({"tube_unproven"})), 0.1)
    return caught.value


ERRORS = [
    errors.ConnectionFailed("no answer"),
    errors.InvalidForce(("stale",), "the samples are old"),
    errors.OtherRegisterMap("tcp://127.0.0.1", 1, 2),
    errors.Tripped("burst", "The balloon has burst.", "Replace the balloon."),
    errors.WriteFailed("the disk is full"),
    failed_vent(FAULTS.codes["vent_shut"], 3.0),
    rejected("hold", "fault_latched"),
    unproven(),
    WriteRejectedError("rejected", "lease"),
]


@pytest.mark.parametrize("error", ERRORS, ids=lambda error: type(error).__name__)
def test_an_error_is_the_same_in_another_process(error):
    error.add_note("a note")
    for restored in (pickle.loads(pickle.dumps(error)), copy.copy(error)):
        assert type(restored) is type(error)
        assert (str(restored), vars(restored)) == (str(error), vars(error))


def test_samples_that_are_back_after_a_lost_link_leave_a_fault_that_the_rejection_names():
    fault = fault_of(FAULTS.codes["link_lost"])
    error = with_fault(rejected("hold", "link_lost"), fault)
    assert error.fault == "link_lost"
    assert f"First-out fault link_lost: {fault.cause} {fault.remedy}" in str(error)
