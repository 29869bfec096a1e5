"""Source that shows a replayed recording on the buses and rejects writes."""

from __future__ import annotations

import logging
from collections.abc import Hashable, Mapping
from typing import Any

from pneuforce.instrument.core.event_counts import EventCounts
from pneuforce.instrument.core.lease import Peer
from pneuforce.instrument.core.peers import Peers
from pneuforce.instrument.core.reject_reason import RejectReason
from pneuforce.instrument.core.requests import log_write
from pneuforce.instrument.core.snapshot import Snapshot
from pneuforce.instrument.recording.paced_replay import PacedReplay
from pneuforce.support.rejected_write import RejectedWrite, RejectedWriteLogger

#: Status bits that are set during each replay, so that a robot does not use the values.
REPLAY_STATUS = frozenset(("simulated", "function_check", "write_protect"))
_REMARK = "this is a replay of a recording, which accepts no write except a vent, and a vent has no effect"
log = logging.getLogger("pneuforce")


class ReplaySource:
    """Recorded quantities for the buses, marked as simulated.

    Each write except a vent is rejected because of write protection. A vent is accepted and has no effect.
    """

    def __init__(self, replay: PacedReplay) -> None:
        self.can_down = False  #: True if the CAN bus of the replay is down
        self.counts = EventCounts()
        self._replay = replay
        self._peers = Peers()
        self._rejected_writes = RejectedWriteLogger(log)

    def snapshot(self, peer: Peer, now_s: float) -> Snapshot:  # noqa: ARG002
        """Return the recorded snapshot at the present time of the replay, with the reject reason for `peer`.

        The status of the snapshot marks the values as simulated.
        """
        replay = self._replay
        snapshot = replay.session.instrument.snapshot(peer, replay.t_s)
        status = REPLAY_STATUS | {"can_down", "maintenance_required"} if self.can_down else REPLAY_STATUS
        reject_reason = self._peers.reject_reason_of(peer)
        return snapshot._replace(status=snapshot.status | status, reject_reason=reject_reason)

    @property
    def discrete_state(self) -> Hashable:
        """Return a value that changes if a sample changes the state, the status or the faults."""
        return self._replay.session.instrument.discrete_state

    @property
    def force_limit_exceeded(self) -> bool:
        """Return True if the latest sample raises the force alarm."""
        return self._replay.session.instrument.force_limit_exceeded

    def write(self, peer: Peer, values: Mapping[str, Any], now_s: float) -> RejectReason:  # noqa: ARG002
        """Reject the write, unless it is a vent."""
        record = self._peers.record_of(peer)
        is_vent = dict(values) == {"mode": "vent"}
        record.reject_reason = RejectReason.NONE if is_vent else RejectReason.WRITE_PROTECT
        log_write(peer, values, record, _REMARK)
        if not is_vent:
            self.counts.count_rejected_write(str(record.reject_reason))
        return record.reject_reason

    def master_lost(self, now_s: float) -> None:
        """Do nothing: no peer commands a replay."""

    def master_recovered(self, now_s: float) -> None:
        """Do nothing: no peer commands a replay."""

    def end(self, why: str, now_s: float) -> None:
        """Do nothing: a replay has no event log."""

    def log_login(self, peer: Peer, kind: str, result: str, now_s: float) -> None:
        """Do nothing: a replay has no event log."""

    def log_failed_logins(
        self,
        peer: Peer,
        reason: str,
        times: int,
        now_s: float,  # noqa: ARG002
        user: str = "",  # noqa: ARG002
    ) -> None:
        """Count the failed logins: a replay has no event log."""
        self.counts.count_failed_logins(peer, reason, times)

    def log_rejected_write(self, peer: Peer, rejected: RejectedWrite, now_s: float) -> None:
        """Log a write request that the bus server rejected."""
        self.counts.count_rejected_write(rejected.reason)
        self._rejected_writes.log(peer, rejected, now_s)
