"""Tests of the lines of `pneuforce hold`: a force that must not be used as a measurement is marked."""

import errno
import json

import pytest

from pneuforce.client.measurement import Measurement, State, Status
from pneuforce.instrument.cli.operate import hold
from pneuforce.instrument.cli.operate.hold import OutputFailed, _is_of_other_bus, _line
from pneuforce.instrument.cli.terminal.exit_codes import ExitCode, exit_code_of


def held(force_n, *status, state=State.HOLDING):
    return Measurement(
        force_or_nan=force_n,
        force_std_or_nan=0.1,
        pressure_kpa=8.0,
        state=state,
        status_or_none=frozenset({Status.HOLDING, *status}),
    )


@pytest.mark.parametrize(
    ("measurement", "ending"),
    [
        (held(1.5), "1.500 N ± 0.200 N (2 u)"),
        (held(0.2, Status.INTERPOLATED), "(2 u); touch only: not a measurement"),
        (
            held(5.5, Status.FORCE_HIGH_ALARM),
            "force ALARM: stop pushing, and back off; 5.500 N ± 0.200 N (2 u)",
        ),
        (held(float("nan"), state=State.INFLATING), "force not available while the balloon is inflating"),
    ],
    ids=["normal", "touch", "alarm", "inflating"],
)
def test_each_line_says_how_the_force_may_be_used(measurement, ending):
    assert _line(1.0, measurement, as_json=False).endswith(ending)


def test_the_reason_of_a_missing_force_is_printed_once_behind_the_alarm():
    flat = held(float("nan"), Status.FORCE_HIGH_ALARM, Status.OUT_OF_RANGE)
    first, later = (_line(1.0, flat, as_json=False, is_explained=known) for known in (False, True))
    assert "force ALARM: stop pushing, and back off; not available: out_of_range" in first
    assert later.endswith("force ALARM: stop pushing, and back off; not available, as before")


def test_the_json_line_contains_the_status():
    values = json.loads(_line(1.0, held(0.2, Status.INTERPOLATED), as_json=True))
    assert (values["state"], values["status"]) == ("holding", ["holding", "interpolated"])


@pytest.mark.parametrize(
    ("holder", "url", "is_other"),
    [("modbus_tcp", "tcp://a", False), ("can", "tcp://a", True), ("modbus_rtu", "rtu:///dev/x", False)],
)
def test_the_lease_of_another_bus_cannot_be_taken_over(holder, url, is_other):
    assert _is_of_other_bus(holder, url) is is_other


@pytest.mark.parametrize("code", [errno.EPIPE, errno.ENOSPC])
def test_a_closed_or_full_output_ends_the_hold_with_a_message(monkeypatch, code):
    def fail(line):
        raise OSError(code, "no reader")

    monkeypatch.setattr(hold, "print_line", fail)
    with pytest.raises(OutputFailed, match="no reader") as caught:
        hold._print_measurement("a line")
    assert exit_code_of(caught.value) is ExitCode.IO_ERROR
