"""Authorization of writes: the complete request is checked before anything changes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pneuforce.instrument.core.arming import HOLD_REJECT_REASONS, STEPS, Arming, Step
from pneuforce.instrument.core.barometer import is_plausible
from pneuforce.instrument.core.lease import Lease, Peer
from pneuforce.instrument.core.peers import PeerRecord
from pneuforce.instrument.core.reject_reason import RejectReason
from pneuforce.protocol.limits import SETPOINT_PA

SETPOINT_KPA = tuple(pa / 1e3 for pa in SETPOINT_PA)


@dataclass(frozen=True, slots=True, kw_only=True)
class WriteContext:
    """Conditions of the instrument that decide whether a write is accepted."""

    arming: Arming
    link_lost: bool
    zeroed: bool
    firmware_allowed: bool  #: the configuration allows an inflation with the firmware of the board
    vented: bool
    reference_monitored: bool  #: the reference pressure must be written periodically, in all states
    in_contact: bool
    ambient_kpa: float  #: configured ambient pressure
    recent_ambient_kpa: float  #: ambient pressure that was written recently, or NaN
    write_protect: bool
    lease_required: bool
    busy: bool  #: a command is in progress
    #: Sequence number of the command in progress. None if this peer's channel did not send it.
    pending_sequence: int | None


def authorize(
    peer: Peer,
    values: Mapping[str, Any],
    record: PeerRecord,
    setpoint_kpa: float,
    lease: Lease,
    context: WriteContext,
) -> RejectReason:
    """Return why a write is rejected, or NONE if it is accepted. A vent alone is always accepted.

    `setpoint_kpa` is the setpoint that was requested earlier [kPa], NaN if no setpoint was requested.
    """
    if set(values) == {"mode"} and values["mode"] == "vent":
        return RejectReason.NONE
    if context.write_protect:
        return RejectReason.WRITE_PROTECT
    if not lease.admits(peer):
        return RejectReason.LEASE
    reason = _check_values(values, context)
    if reason is RejectReason.NONE and values.get("mode") == "hold":
        reason = _check_hold(values.get("setpoint_requested_kpa", setpoint_kpa), record, context)
    if (
        reason is RejectReason.NONE
        and context.lease_required
        and _holds_without_lease(values, lease, context)
    ):
        reason = RejectReason.LEASE
    return reason


def _check_values(values: Mapping[str, Any], context: WriteContext) -> RejectReason:
    if not SETPOINT_KPA[0] <= values.get("setpoint_requested_kpa", SETPOINT_KPA[0]) <= SETPOINT_KPA[1]:
        return RejectReason.STATE
    if "reference_pressure_kpa" in values and not (context.vented or context.reference_monitored):
        return RejectReason.IN_CONTACT if context.in_contact else RejectReason.STATE
    if "ambient_pressure_kpa" in values and not is_plausible(
        values["ambient_pressure_kpa"], context.ambient_kpa, context.recent_ambient_kpa
    ):
        return RejectReason.IMPLAUSIBLE
    sequence = values.get("command_sequence", context.pending_sequence)
    if context.busy and sequence != context.pending_sequence:
        return RejectReason.STATE
    return RejectReason.NONE


def _holds_without_lease(values: Mapping[str, Any], lease: Lease, context: WriteContext) -> bool:
    mode = values.get("mode", "hold" if context.arming is Arming.HOLDING else "vent")
    return mode == "hold" and not values.get("lease_s", lease.duration_s) > 0


def _check_hold(setpoint_kpa: float, record: PeerRecord, context: WriteContext) -> RejectReason:
    """Return why "hold" is rejected, or NONE.

    If the rig does not hold and the last mode of this peer was "hold", the new "hold" may be a repetition.
    The peer has to write "vent" first. Otherwise a program that writes "hold" in each cycle would undo the
    vent of another peer.
    """
    if context.link_lost:
        return RejectReason.LINK_LOST
    if Step.HOLD not in STEPS[context.arming]:
        return HOLD_REJECT_REASONS[context.arming]
    if not context.zeroed:
        return RejectReason.NOT_ZEROED
    if not context.firmware_allowed:
        return RejectReason.UNKNOWN_FIRMWARE
    if context.arming is Arming.READY and record.mode == "hold":
        return RejectReason.STATE
    return RejectReason.NONE if math.isfinite(setpoint_kpa) else RejectReason.STATE
