"""Execution: what a request is judged by, and what an accepted one does to the instrument."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from instrument.arming import Arming
from instrument.lease import Peer
from instrument.refusal import Refusal
from instrument.requests import PeerMemory, Situation

if TYPE_CHECKING:
    from instrument.core import Instrument

log = logging.getLogger("pneuforce")


def situation_of(instrument: Instrument, peer: Peer, now_s: float) -> Situation:
    """What the verdict on a request of `peer` depends on, at `now_s`."""
    commands = instrument.commands(peer)
    return Situation(
        arming=instrument.arming,
        link_lost=instrument.link_lost(now_s),
        zeroed=instrument.chain.zero.taken,
        vented=instrument.vented(now_s),
        in_contact=instrument.measurement.in_contact,
        write_lock=instrument.settings.write_lock,
        lease_demanded=instrument.settings.lease_demanded,
        busy=instrument.operations.busy,
        answer_due=commands.sequence if commands.answer_state == "busy" else None,
    )


def carry_out(instrument: Instrument, peer: Peer, values: Mapping[str, Any], now_s: float) -> None:
    """Do what an accepted request says: first its values, then its mode, then its command."""
    wanted, lease = instrument.wanted, instrument.lease
    wanted.setpoint_kpa = values.get("setpoint_requested_kpa", wanted.setpoint_kpa)
    wanted.force_limit_n = values.get("force_limit_n", wanted.force_limit_n)
    if "reference_pressure_kpa" in values:
        wanted.reference_kpa = instrument.chain.reference_kpa = values["reference_pressure_kpa"]
    if "lease_s" in values:
        lease.take(peer, values["lease_s"], now_s)
    lease.renew(peer, now_s)
    if values.get("mode") == "vent":
        instrument.vent(now_s)
    elif values.get("mode") == "hold":
        instrument.hold()
    if instrument.arming is Arming.HOLDING:
        instrument.held_setpoint_kpa = wanted.setpoint_kpa
    if any(name.startswith("command_") for name in values):
        instrument.commands(peer).write(peer, values, now_s)


def tell(peer: Peer, values: Mapping[str, Any], refusal: Refusal, memory: PeerMemory) -> None:
    """Log a write, but not its repetitions: a PLC may write the same every cycle."""
    wrote = ", ".join(f"{name} {value}" for name, value in values.items())
    told = f"{wrote}: {'done' if refusal is Refusal.NONE else f'refused, {refusal}'}"
    if told != memory.told:
        memory.told = told
        log.info("%s wrote %s", " ".join(peer).strip(), told)
