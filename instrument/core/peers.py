"""Records of the peers that have written: last mode, permission of proof tests, and last command."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from pneuforce.instrument.core.command_block import CommandBlock
from pneuforce.instrument.core.lease import Peer
from pneuforce.instrument.core.reject_reason import RejectReason

MAX_PEERS = 256
#: Channels whose peers share one command block, because all of them receive the same snapshot.
_SHARED_CHANNELS = frozenset({"web"})


@dataclass(slots=True)
class PeerRecord:
    """Last write of one peer."""

    reject_reason: RejectReason = RejectReason.NONE
    mode: str = "vent"  #: last mode that this peer wrote
    proof_test: str = "allowed"  #: "forbidden" if this peer forbids proof tests
    logged: str = ""  #: log line of the last logged write
    written_s: float = -math.inf  #: time of the last write of this peer
    command: CommandBlock = field(default_factory=CommandBlock)

    def forbids_proof_tests(self, since_s: float) -> bool:
        """Return True if this peer forbids proof tests and has written anything since `since_s`.

        A peer that has disappeared must not forbid the proof tests for ever.
        """
        return self.proof_test == "forbidden" and self.written_s >= since_s


@dataclass(slots=True)
class Peers:
    """Records of up to 256 peers.

    If the table is full, the oldest record whose last mode is "vent" is removed. A record whose last mode is
    "hold" is removed only if all records have this mode. After such a removal, "hold" is assumed as the last
    mode of each unknown peer, because its next "hold" may be a repetition.
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

    def command_block(self, peer: Peer) -> CommandBlock:
        """Return the command block for a command of `peer`. Create its record if it is missing."""
        return self.record_of(_commander(peer)).command

    def last_command(self, peer: Peer) -> CommandBlock:
        """Return the command block for `peer` to read. A peer that only reads gets no record."""
        record = self._records.get(_commander(peer))
        return record.command if record else CommandBlock()

    def finish_commands(self, result: RejectReason) -> None:
        """Set the answer of each command in progress."""
        for record in self._records.values():
            record.command.finish(result)

    def knows(self, peer: Peer) -> bool:
        """Return True if `peer` has a record. All peers without a record receive equal values."""
        return peer in self._records or _commander(peer) in self._records

    def forbid_proof_tests(self, since_s: float) -> bool:
        """Return True if at least one peer that has written since `since_s` forbids proof tests."""
        return any(record.forbids_proof_tests(since_s) for record in self._records.values())

    def proof_test_of(self, peer: Peer, since_s: float) -> str:
        """Return "forbidden" if `peer` has written since `since_s` and forbids proof tests, or "allowed"."""
        record = self._records.get(peer)
        return "forbidden" if record and record.forbids_proof_tests(since_s) else "allowed"

    def reject_reason_of(self, peer: Peer) -> RejectReason:
        """Return why the last write of `peer` was rejected. A peer that only reads gets no record."""
        record = self._records.get(peer)
        return record.reject_reason if record else RejectReason.NONE


def _commander(peer: Peer) -> Peer:
    """Return the peer whose record contains the command block of `peer`."""
    channel, _ = peer
    return (channel, "") if channel in _SHARED_CHANNELS else peer
