"""Execution of accepted writes."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from functools import partial
from typing import Any

from pneuforce.instrument.core.arming import Arming
from pneuforce.instrument.core.authorization import WriteContext
from pneuforce.instrument.core.lease import Peer
from pneuforce.instrument.core.operations import run
from pneuforce.instrument.core.peers import PeerRecord
from pneuforce.instrument.core.reject_reason import REMEDIES, RejectReason
from pneuforce.instrument.core.state import InstrumentState
from pneuforce.support.rejected_write import describe_quantity, describe_write

log = logging.getLogger("pneuforce")

#: Quantities that are only stored until they are used, and their fields in `RequestedValues`.
_STORED = {
    "setpoint_requested_kpa": "setpoint_kpa",
    "force_limit_n": "force_limit_n",
    "force_limit_2_n": "force_limit_2_n",
    "alarm_hysteresis_n": "alarm_hysteresis_n",
    "alarm_delay_s": "alarm_delay_s",
}


def write_context_of(state: InstrumentState, peer: Peer, now_s: float) -> WriteContext:
    """Return the conditions that decide on a write of `peer` at `now_s`."""
    block = state.peers.last_command(peer)
    return WriteContext(
        arming=state.arming,
        link_lost=state.link_lost(now_s),
        zeroed=state.chain.zero.taken,
        firmware_allowed=state.firmware_allowed,
        vented=state.vented(now_s),
        reference_monitored=state.settings.reference_timeout_s > 0,
        in_contact=state.measurement.in_contact,
        ambient_kpa=state.settings.chain.circuit.ambient_kpa,
        recent_ambient_kpa=state.recent_ambient_kpa(now_s),
        write_protect=state.settings.write_protect,
        lease_required=state.settings.lease_required,
        busy=state.clearing.pending,
        pending_sequence=block.sequence if block.answer_state == "busy" else None,
    )


def execute(state: InstrumentState, peer: Peer, values: Mapping[str, Any], now_s: float) -> None:
    """Execute an accepted write: first its values, then its mode, then its command."""
    requested, lease = state.requested, state.lease
    for quantity, name in _STORED.items():
        if quantity in values:
            setattr(requested, name, values[quantity])
    if "reference_pressure_kpa" in values:
        requested.reference_kpa, requested.reference_written_s = values["reference_pressure_kpa"], now_s
        if state.vented(now_s):
            state.chain.reference_kpa = requested.reference_kpa
        else:
            state.chain.check_reference(requested.reference_kpa)
    if "ambient_pressure_kpa" in values:
        requested.ambient_kpa, requested.ambient_written_s = values["ambient_pressure_kpa"], now_s
    if "proof_test" in values:
        state.peers.record_of(peer).proof_test = values["proof_test"]
    if "lease_s" in values:
        lease.take(peer, values["lease_s"], now_s)
    lease.renew(peer, now_s)
    if values.get("mode") == "vent":
        state.vent(now_s)
    elif values.get("mode") == "hold":
        state.hold()
    if state.arming is Arming.HOLDING:
        state.held_setpoint_kpa = requested.setpoint_kpa
    if any(name.startswith("command_") for name in values):
        state.peers.command_block(peer).write(peer, values, partial(run, state, now_s=now_s))


def log_write(peer: Peer, values: Mapping[str, Any], record: PeerRecord, remark: str = "") -> None:
    """Log a write and its result. Skip repetitions, because a PLC may write the same values in each cycle.

    `remark` replaces the remedy that belongs to the reject reason.
    """
    written = ", ".join(describe_quantity(name, value) for name, value in values.items())
    reason = record.reject_reason
    result = "accepted" if reason is RejectReason.NONE else f"rejected, {reason}"
    if values.get("mode") == "vent" and reason is not RejectReason.NONE:
        result += " (vented nevertheless)"
    line = describe_write(peer, written, ": ".join(filter(None, (result, remark or REMEDIES.get(reason)))))
    if line != record.logged:
        record.logged = line
        log.info("%s", line)
