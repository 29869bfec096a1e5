"""Commands of the demo: first inflation, the setpoints of the scenario, and recovery after an overload."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from pneuforce.instrument.core.faults import HostFault, name_of
from pneuforce.protocol.frames import Fault
from pneuforce.registers.modbus.client import ModbusClient, ModbusClientError, WriteRejectedError
from pneuforce.teststand.observer import value_or_nan

_BUSY = "the computer was suspended or busy"
#: Faults that an overloaded computer can cause, with their possible causes. The demo clears only these. The
#: user clears all others.
OVERLOAD_CAUSES: Mapping[int, str] = {
    Fault.HOST_SILENT: _BUSY,
    HostFault.LINK_LOST: f"no samples arrived: the cable of the rig was pulled, or {_BUSY}",
    HostFault.DISAGREEMENT: _BUSY,
    HostFault.NOT_VENTED: _BUSY,
}
ANSWER_TIMEOUT_S = 2.0
#: Reject reasons of a command that was sent after a trip and before the trip was observed.
_TRIPPED_MEANWHILE = frozenset(("fault_latched", "link_lost", "not_zeroed"))


class DemoSequence:
    """Commands of the demo: vent, setpoint and hold, then the setpoints of the scenario.

    The sequence ends as soon as another client has written a setpoint or taken the lease, or the instrument
    has rejected a command. After a lost connection, the interrupted commands are repeated.
    """

    def __init__(self, connect: Callable[[], ModbusClient]) -> None:
        """Use connections that `connect` opens. `connect` raises ModbusClientError."""
        #: One sentence about a trip or about the end of the sequence; otherwise "".
        self.report = ""
        self._connect = connect
        #: The last two setpoints of the demo. The observed setpoint can still be the older of the two.
        self._commanded_kpa = (math.nan, math.nan)
        self._accepted_kpa = math.nan
        self._inflation_due = True  # also True if an inflation was interrupted
        self._held = False  # the demo holds the balloon, and no user has vented it
        self._hold_observed = False  # the registers have shown the last hold of the demo
        self._end_report = ""  # not empty after the end of the sequence

    def step(self, values: dict[str, Any], wanted_kpa: float) -> None:
        """Command the setpoint `wanted_kpa` if this setpoint is new or the rig has tripped.

        No command is sent before the zero adjustment, or after a trip while no samples arrive. `values` are
        the observed registers. After a trip by an overload, the faults are cleared first.
        """
        if not values:
            return
        recovers = not self._end_report and (self._held or self._inflation_due)
        self.report = _describe_trip(values, recovers) or self._end_report
        if self._end_report:
            return
        if self._is_taken_over(values):
            self._end("another client commands the instrument", values)
            return
        if "not_zeroed" in values["status"] or not math.isfinite(wanted_kpa):
            return
        tripped = values["state"] == "tripped"
        if not tripped and not self._inflation_due:
            self._observe_mode(values["mode"])
        if tripped and (not recovers or "stale" in values["status"]):
            return
        if not (tripped or self._inflation_due) and wanted_kpa == self._accepted_kpa:
            return
        try:
            with self._connect() as plc:
                self._command(plc, wanted_kpa, tripped)
        except WriteRejectedError as error:
            # After a trip, try again: its cause can persist for a while.
            if not tripped and error.reason not in _TRIPPED_MEANWHILE:
                self._end(str(error), values)
        except ModbusClientError:
            pass  # the next step tries again

    def _observe_mode(self, mode: str) -> None:
        """Find out if a user has vented the balloon. A mode from before the hold of the demo is ignored."""
        if mode == "hold":
            self._held = self._hold_observed = True
        elif self._hold_observed:
            self._held = False

    def _is_taken_over(self, values: dict[str, Any]) -> bool:
        requested_kpa = value_or_nan(values, "setpoint_requested")
        own_setpoint = math.isnan(requested_kpa) or any(
            math.isclose(requested_kpa, setpoint_kpa, rel_tol=1e-6) for setpoint_kpa in self._commanded_kpa
        )
        return not own_setpoint or values["lease_holder"] != "none"

    def _end(self, reason: str, values: dict[str, Any]) -> None:
        """End the sequence. A trip is still reported, now and later."""
        self._end_report = f"{reason}: the demo sends no more commands"
        self.report = _describe_trip(values, recovers=False) or self._end_report

    def _command(self, plc: ModbusClient, setpoint_kpa: float, tripped: bool) -> None:
        """Write a setpoint. Inflate the balloon if an inflation is due or the rig has tripped."""
        if tripped:
            if not cleared_after_overload(plc):
                return
            self._inflation_due = True
        if setpoint_kpa != self._commanded_kpa[0]:
            self._commanded_kpa = (setpoint_kpa, self._commanded_kpa[0])
        if self._inflation_due:
            plc.write("mode", "vent")
        plc.write("setpoint_requested", setpoint_kpa)
        self._accepted_kpa = setpoint_kpa
        if self._inflation_due:
            plc.write("mode", "hold")
            self._inflation_due, self._held, self._hold_observed = False, True, False


def _describe_trip(values: Mapping[str, Any], recovers: bool) -> str:
    """Return the cause of a trip and what happens next.

    Return "" without a trip, or if the cause has not been read yet.
    """
    faults = _latched_faults(values)
    if values.get("state") != "tripped" or not faults:
        return ""
    trip = f"the rig has tripped: {', '.join(f'{name_of(code)} (fault {code})' for code in faults)}"
    if recovers and OVERLOAD_CAUSES.keys() >= set(faults):
        cause = OVERLOAD_CAUSES[faults[0]]
        return f"{trip}: {cause}; when the cause is gone, the demo clears the fault and inflates again"
    return f"{trip}; remove the cause, then clear the fault on the web page"


def _latched_faults(values: Mapping[str, Any]) -> list[int]:
    """Return the codes of the latched faults, the first-out fault first; none if it has not been read yet."""
    first = int(values.get("first_out_fault", 0))
    mask = int(values.get("latched_faults_1", 0)) | int(values.get("latched_faults_2", 0)) << 32
    return [first, *(code for code in range(64) if mask >> code & 1 and code != first)] if first else []


def cleared_after_overload(plc: ModbusClient) -> bool:
    """Clear the faults if an overload can have caused each. Return True if the faults were cleared.

    Raises ModbusClientError.
    """
    faults = _latched_faults(plc.read_all())
    if not faults or not OVERLOAD_CAUSES.keys() >= set(faults):
        return False
    return plc.run_command("clear_faults", timeout_s=ANSWER_TIMEOUT_S) == "none"
