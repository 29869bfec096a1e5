"""Commands of the demo: first inflation, the setpoints of the scenario, and recovery after an overload."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from pneuforce.instrument.core.faults import HostFault
from pneuforce.protocol.frames import Fault
from pneuforce.registers.modbus.client import ModbusClient, ModbusClientError
from pneuforce.teststand.observer import value_or_nan

#: Faults that an overloaded computer can cause. The demo clears only these. The user clears all others.
OVERLOAD_FAULTS = frozenset(
    (Fault.HOST_SILENT, HostFault.LINK_LOST, HostFault.DISAGREEMENT, HostFault.NOT_VENTED)
)
ANSWER_TIMEOUT_S = 2.0


class DemoSequence:
    """Commands of the demo: vent, setpoint and hold, then the setpoints of the scenario.

    The sequence ends as soon as another client has written a setpoint or taken the lease, or the instrument
    has rejected a command.
    """

    def __init__(self, connect: Callable[[], ModbusClient]) -> None:
        """Use connections that `connect` opens. `connect` raises ModbusClientError."""
        self._connect = connect
        #: The last two setpoints of the demo. The observed setpoint can still be the older of the two.
        self._commanded_kpa = (math.nan, math.nan)
        self._tripped = False
        self._held = False  # mode was "hold" before the trip; otherwise a user has vented the balloon
        self._done = False

    def step(self, values: dict[str, Any], wanted_kpa: float) -> None:
        """Command the setpoint `wanted_kpa` if this setpoint is new or the rig has tripped.

        No command is sent before the zero adjustment. `values` are the observed registers. After a trip by an
        overload, the faults are cleared first.
        """
        if (
            self._done
            or "not_zeroed" in values.get("status", {"not_zeroed"})
            or not math.isfinite(wanted_kpa)
        ):
            return
        self._tripped = values["state"] == "tripped"
        if not self._tripped:
            self._held = values["mode"] == "hold"
        elif not self._held:
            return
        if wanted_kpa == self._commanded_kpa[0] and not self._tripped:
            return
        requested_kpa = value_or_nan(values, "setpoint_requested")
        own_setpoint = any(
            math.isclose(requested_kpa, setpoint_kpa, rel_tol=1e-6) for setpoint_kpa in self._commanded_kpa
        )
        first = math.isnan(requested_kpa) and math.isnan(self._commanded_kpa[0])
        if not (own_setpoint or first) or values["lease_holder"] != "none":
            self._done = True
            return
        try:
            with self._connect() as plc:
                self._command(plc, wanted_kpa, first)
        except ModbusClientError:
            self._done = not self._tripped  # after a trip, try again: its cause can persist for a while

    def _command(self, plc: ModbusClient, setpoint_kpa: float, first: bool) -> None:
        """Write a setpoint. Inflate the balloon if this is the first setpoint or the rig has tripped."""
        if self._tripped and not cleared_after_overload(plc):
            return
        self._commanded_kpa = (setpoint_kpa, self._commanded_kpa[0])
        if first or self._tripped:
            plc.write("mode", "vent")
        plc.write("setpoint_requested", setpoint_kpa)
        if first or self._tripped:
            plc.write("mode", "hold")


def cleared_after_overload(plc: ModbusClient) -> bool:
    """Clear the faults if an overload caused the trip. Return True if the faults were cleared.

    Raises ModbusClientError.
    """
    values = plc.read_all()
    if values["first_out_fault"] not in OVERLOAD_FAULTS:
        return False
    return plc.run_command("clear_faults", timeout_s=ANSWER_TIMEOUT_S) == "none"
