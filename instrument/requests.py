"""Requests: whether a peer's write may pass, judged whole before anything is touched."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from instrument.arming import HOLD_REFUSALS, STEPS, Arming, Step
from instrument.lease import Lease, Peer
from instrument.refusal import Refusal
from instrument.rig.limits import SETPOINT_PA

MOST_PEERS = 256
SETPOINT_KPA = tuple(pa / 1e3 for pa in SETPOINT_PA)


@dataclass(slots=True)
class PeerMemory:
    """What is remembered of one peer."""

    refusal: Refusal = Refusal.NONE
    mode: str = "vent"  #: the mode that it wrote last
    told: str = ""  #: its last write as it was logged


@dataclass(slots=True)
class Wanted:
    """What the peers asked for, as last accepted."""

    setpoint_kpa: float = math.nan
    force_limit_n: float = 5.0
    mode: str = "vent"
    reference_kpa: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Situation:
    """What a verdict depends on."""

    arming: Arming
    link_lost: bool
    zeroed: bool
    vented: bool
    in_contact: bool
    write_lock: bool
    lease_demanded: bool
    busy: bool  #: a command is under way
    answer_due: int | None  #: its sequence, where this peer's channel gave it


@dataclass(slots=True)
class Peers:
    """The peers seen: the least recent is forgotten first, and one that wrote "hold" last of all.

    Once such a one had to be forgotten, whoever is unknown is taken for it: its "hold" may be a repetition.
    """

    _memories: dict[Peer, PeerMemory] = field(default_factory=dict)
    _unknown: str = "vent"  # mode that an unknown peer may have written last

    def of(self, peer: Peer) -> PeerMemory:
        """Memory of one peer that writes."""
        memory = self._memories.pop(peer, None) or PeerMemory(mode=self._unknown)
        if len(self._memories) >= MOST_PEERS:
            self._forget_one()
        self._memories[peer] = memory
        return memory

    def _forget_one(self) -> None:
        harmless = (peer for peer, memory in self._memories.items() if memory.mode == "vent")
        forgotten = self._memories.pop(next(harmless, next(iter(self._memories))))
        if forgotten.mode != "vent":
            self._unknown = forgotten.mode

    def refusal_of(self, peer: Peer) -> Refusal:
        """Its last refusal; who only reads is not remembered."""
        memory = self._memories.get(peer)
        return memory.refusal if memory else Refusal.NONE


def verdict(
    peer: Peer, values: Mapping[str, Any], memory: PeerMemory, wanted: Wanted, lease: Lease, now: Situation
) -> Refusal:
    """Why a write may not pass, NONE where it may. A vent alone always passes."""
    if set(values) == {"mode"} and values["mode"] == "vent":
        return Refusal.NONE
    if now.write_lock:
        return Refusal.WRITE_LOCK
    if not lease.admits(peer):
        return Refusal.LEASE
    refusal = _values_verdict(values, now)
    if refusal is Refusal.NONE and values.get("mode") == "hold":
        refusal = _hold_verdict(values, memory, wanted, now)
    if refusal is Refusal.NONE and now.lease_demanded and _would_hold_unleased(values, lease, now):
        refusal = Refusal.LEASE
    return refusal


def _values_verdict(values: Mapping[str, Any], now: Situation) -> Refusal:
    if not SETPOINT_KPA[0] <= values.get("setpoint_requested_kpa", SETPOINT_KPA[0]) <= SETPOINT_KPA[1]:
        return Refusal.STATE
    if "reference_pressure_kpa" in values and not now.vented:
        return Refusal.IN_CONTACT if now.in_contact else Refusal.STATE
    if now.busy and values.get("command_sequence", now.answer_due) != now.answer_due:
        return Refusal.STATE
    return Refusal.NONE


def _would_hold_unleased(values: Mapping[str, Any], lease: Lease, now: Situation) -> bool:
    mode = values.get("mode", "hold" if now.arming is Arming.HOLDING else "vent")
    return mode == "hold" and not values.get("lease_s", lease.duration_s) > 0


def _hold_verdict(values: Mapping[str, Any], memory: PeerMemory, wanted: Wanted, now: Situation) -> Refusal:
    """Why "hold" may not pass.

    Where the rig is not holding, a peer whose last mode was "hold" only repeats itself: it has to write
    "vent" before its "hold" is a wish of today. Else a program that never stops writing "hold" would undo
    another's vent.
    """
    if now.link_lost:
        return Refusal.LINK_LOST
    if Step.HOLD not in STEPS[now.arming]:
        return HOLD_REFUSALS[now.arming]
    if not now.zeroed:
        return Refusal.NOT_ZEROED
    if now.arming is Arming.READY and memory.mode == "hold":
        return Refusal.STATE
    setpoint_kpa = values.get("setpoint_requested_kpa", wanted.setpoint_kpa)
    return Refusal.NONE if math.isfinite(setpoint_kpa) else Refusal.STATE
