"""Tests of the lines of `pneuforce status`."""

import pytest

from pneuforce.client.details import Details, fault_named
from pneuforce.client.measurement import Measurement, State, Status
from pneuforce.instrument.cli.operate.status import lines
from pneuforce.registers.advice import MAINTENANCE_ADVICE
from pneuforce.registers.codes import MAINTENANCE_CAUSES

URL = "tcp://127.0.0.1:5020?unit=1"


@pytest.mark.parametrize(
    ("details", "text"),
    [
        (
            Details(firmware_version=0x102, firmware_origin="unknown", firmware_image=0xDEADBEEF),
            "1.2, image DEADBEEF: The image on the board is not a released image",
        ),
        (
            Details(firmware_version=0x102, firmware_origin="current", firmware_image=0x12),
            "1.2, image 00000012: The board has the firmware of the package",
        ),
        (Details(firmware_version=0, firmware_origin="not_reported", firmware_image=0), "No board has"),
        (Details(), "unknown"),  # raw CAN does not transmit the firmware
    ],
)
def test_the_firmware_is_named_with_its_origin(details, text):
    assert dict(lines(Measurement(), details, URL))["firmware"].startswith(text)


def texts(state, *status, fault=""):
    """Return the names and texts of the lines for a measurement without a force."""
    faults = (fault_named(fault),) if fault else ()
    details = Details(first_out_fault=faults[0] if faults else None, latched_faults=faults)
    measurement = Measurement(state=state, status_or_none=frozenset(status))
    return list(lines(measurement, details, URL))


@pytest.mark.parametrize(
    ("shown", "attention"),
    [
        (texts(State.TRIPPED, Status.BURST, Status.FAILURE, fault="burst"), []),
        (texts(State.TRIPPED, Status.LINK_LOST, Status.STALE, fault="link_lost"), []),
        (texts(State.TRIPPED, Status.STALE, Status.BURST, fault="burst"), ["stale"]),
        (texts(State.TRIPPED, Status.VENT_FAULT, fault="vent_shut"), []),
        (texts(State.HOLDING, Status.OUT_OF_RANGE, Status.OUT_OF_SPECIFICATION), ["out_of_range"]),
        (texts(State.VENTED, Status.NOT_ZEROED, Status.FUNCTION_CHECK), ["not_zeroed"]),
        (texts(State.SETTLING, Status.INFLATING, Status.FUNCTION_CHECK), []),
    ],
)
def test_each_condition_is_explained_once(shown, attention):
    assert [text.split(":")[0] for name, text in shown if name == "attention"] == attention
    sentences = [part.strip() for _, text in shown for part in text.replace(": ", ". ").split(". ")]
    explained = [sentence for sentence in sentences if len(sentence.split()) > 3]
    assert sorted(set(explained)) == sorted(explained)


def test_the_force_limit_is_shown():
    assert dict(lines(Measurement(), Details(force_limit_n=4.5), URL))["limit"].startswith("4.5 N")
    assert "limit" not in dict(lines(Measurement(), Details(), URL))  # raw CAN does not transmit the limit


def test_a_proof_test_is_explained_in_the_line_of_the_force():
    force = dict(texts(State.HOLDING, Status.HOLDING, Status.FUNCTION_CHECK))["force"]
    assert "proof test" in force


def test_each_cause_of_maintenance_has_a_line_with_its_remedy():
    required = Measurement(state=State.VENTED, status_or_none=frozenset({Status.MAINTENANCE_REQUIRED}))
    causes = frozenset(bit.name for bit in MAINTENANCE_CAUSES.bits)
    shown = [
        text for name, text in lines(required, Details(maintenance_causes=causes), URL) if name == "attention"
    ]
    assert [text.split(": ")[1] for text in shown] == sorted(causes)
    for text in shown:
        assert text.endswith(MAINTENANCE_ADVICE[text.split(": ")[1]].do), text


@pytest.mark.parametrize("causes", [None, frozenset()])
def test_an_instrument_that_does_not_name_the_causes_is_said_to_need_maintenance(causes):
    required = Measurement(state=State.VENTED, status_or_none=frozenset({Status.MAINTENANCE_REQUIRED}))
    shown = dict(lines(required, Details(maintenance_causes=causes), URL))
    assert shown["attention"].startswith("maintenance_required: Maintenance required")
