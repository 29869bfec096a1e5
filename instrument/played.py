"""A replay as buses see it: an instrument that shows what was recorded, and that nobody commands."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from instrument.execution import tell
from instrument.lease import Peer
from instrument.refusal import Refusal
from instrument.requests import Peers
from instrument.snapshot import Snapshot
from instrument.tape.playing import Playing

#: What a robot must see of any replay, whatever was recorded.
MARKS = frozenset(("simulated", "function_check", "write_lock"))


class Played:
    """What buses see of a replay: every quantity as recorded, marked so that none takes it for a rig.

    Each write is refused by the write lock; a vent alone is accepted as ever, and there is nothing to vent.
    """

    def __init__(self, playing: Playing) -> None:
        self.can_down = False  #: of the bus that shows the replay
        self._playing = playing
        self._peers = Peers()

    def snapshot(self, peer: Peer, now_s: float) -> Snapshot:  # noqa: ARG002
        """The recorded instant that has come, as `peer` would have seen it."""
        playing = self._playing
        shown = playing.coupling.instrument.snapshot(peer, playing.t_s)
        marks = MARKS | {"can_down", "maintenance"} if self.can_down else MARKS
        return shown._replace(status=shown.status | marks, refusal=self._peers.refusal_of(peer))

    def write(self, peer: Peer, values: Mapping[str, Any], now_s: float) -> Refusal:  # noqa: ARG002
        """Refuse it, unless it is a vent."""
        memory = self._peers.of(peer)
        memory.refusal = Refusal.NONE if dict(values) == {"mode": "vent"} else Refusal.WRITE_LOCK
        tell(peer, values, memory.refusal, memory)
        return memory.refusal

    def master_lost(self, now_s: float) -> None:
        """Nobody commands a replay."""

    def master_back(self, now_s: float) -> None:
        """Nobody commands a replay."""

    def end(self, why: str, now_s: float) -> None:
        """Nobody keeps a log of it."""

    def refused(self, peer: Peer, request: bytes, why: str, now_s: float) -> None:
        """Nobody keeps a log of it."""
