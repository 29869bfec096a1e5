"""Peers that have written to the instrument, and the mode that each wrote last."""

from __future__ import annotations

from dataclasses import dataclass, field

from pneuforce.instrument.core.lease import Peer
from pneuforce.instrument.core.reject_reason import RejectReason

MAX_PEERS = 256


@dataclass(slots=True)
class PeerRecord:
    """Last write of one peer."""

    reject_reason: RejectReason = RejectReason.NONE
    mode: str = "vent"  #: the mode that this peer wrote last
    logged: str = ""  #: the last write of this peer as it was logged


@dataclass(slots=True)
class Peers:
    """Records of up to 256 peers.

    When the table is full, the least recent peer whose last mode was "vent" is removed first. A peer whose
    last mode was "hold" is removed only if no other peer is left. From then on each unknown peer counts as
    one that wrote "hold", because its next "hold" may be a repetition.
    """

    _records: dict[Peer, PeerRecord] = field(default_factory=dict)
    _unknown_mode: str = "vent"

    def record_of(self, peer: Peer) -> PeerRecord:
        """Return the record of a peer that writes, and create the record if it is missing."""
        record = self._records.pop(peer, None) or PeerRecord(mode=self._unknown_mode)
        if len(self._records) >= MAX_PEERS:
            self._remove_one()
        self._records[peer] = record
        return record

    def _remove_one(self) -> None:
        vented = (peer for peer, record in self._records.items() if record.mode == "vent")
        removed = self._records.pop(next(vented, next(iter(self._records))))
        if removed.mode != "vent":
            self._unknown_mode = removed.mode

    def reject_reason_of(self, peer: Peer) -> RejectReason:
        """Return why the last write of `peer` was rejected. A peer that only reads gets no record."""
        record = self._records.get(peer)
        return record.reject_reason if record else RejectReason.NONE
