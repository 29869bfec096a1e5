"""Vent at the end of the host process: how long to wait for its verification, and its result in words."""

from __future__ import annotations

from pneuforce.instrument.core.controller import Instrument
from pneuforce.instrument.core.faults import described
from pneuforce.registers.advice import MAINTENANCE_ADVICE

MAX_VENT_S = 5.0  #: longest wait for the verification; a blocked vent is a fault after 3 s
MAX_ANSWER_S = 0.3  #: longest wait if the vent cannot be verified: no samples arrive, or a fault contradicts


class LastVent:
    """Vent that was sent at `begin_s`, or that could not be sent because the port is not open."""

    def __init__(self, instrument: Instrument, begin_s: float) -> None:
        self.verified = False
        self._instrument = instrument
        self._begin_s = begin_s

    def pending(self, now_s: float, port_open: bool) -> bool:
        """Return True while a verification can still arrive. Store whether it has arrived."""
        instrument = self._instrument
        is_new = instrument.measurement.t_s > self._begin_s
        vented = is_new and instrument.vented(now_s) and not instrument.vent_doubtful
        self.verified = vented and not instrument.proof_tests.tube_unproven
        silent = instrument.link_lost(now_s) and not instrument.resuming(now_s)
        longest_s = MAX_ANSWER_S if silent or instrument.vent_doubtful else MAX_VENT_S
        return port_open and not vented and now_s - self._begin_s < longest_s

    def result(self, now_s: float, port_open: bool) -> str:
        """Return what is known about the vent at the end."""
        instrument = self._instrument
        alone = f"without a host, the board vents after {instrument.settings.host_timeout_s:g} s"
        if self.verified:
            return "vented, verified"
        if not port_open:
            return f"the vent could not be sent, because the port of the rig is not open: {alone}"
        if instrument.link_lost(now_s):
            return f"the vent was sent, but not verified, because no samples arrive from the rig: {alone}"
        if instrument.vented(now_s) and instrument.proof_tests.tube_unproven:
            reason = MAINTENANCE_ADVICE["tube_unproven"].what.rstrip(".")
            return f"the vent was sent, but not verified: {reason}"
        pressure = f"the sensor reads {instrument.measurement.pressure_kpa:.3f} kPa"
        fault = f", fault: {described(instrument.faults.first)}" if len(instrument.faults) else ""
        return f"the vent was sent, but not verified: {pressure} after {now_s - self._begin_s:.1f} s{fault}"
