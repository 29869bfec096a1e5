"""The command block: key, code and argument, run once for each new sequence number."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from instrument.lease import Peer
from instrument.refusal import Refusal

#: What a command does; it answers with a refusal, NONE where it is done, or None where it is still busy.
Run = Callable[[int, float], Refusal | None]


@dataclass(slots=True)
class CommandBlock:
    """What was written, and the answer to it."""

    runs: Mapping[str, Run]
    key: int = 0
    code: str = "none"
    argument: int = 0
    sequence: int = 0
    answer_sequence: int = 0
    answer_state: str = "idle"
    answer_result: Refusal = Refusal.NONE
    _writer: Peer | None = None

    def write(self, peer: Peer, values: Mapping[str, Any], now_s: float) -> None:
        """Store what was written; a new sequence number runs the command, the same one repeats its answer.

        The key is used up by each sequence number written, and turns in no other peer's hand.
        """
        if peer != self._writer:
            self._writer, self.key = peer, 0
        self.key = int(values.get("command_key", self.key))
        self.code = str(values.get("command_code", self.code))
        self.argument = int(values.get("command_argument", self.argument))
        if "command_sequence" not in values:
            return
        run = self.runs.get(self.code) if self.key else None
        self.key = 0
        if values["command_sequence"] == self.sequence:
            return
        self.sequence = self.answer_sequence = int(values["command_sequence"])
        self.answer_state, self.answer_result = "busy", Refusal.NONE
        result = run(self.argument, now_s) if run else Refusal.STATE
        if result is not None:
            self.finish(result)

    def finish(self, result: Refusal) -> None:
        """Give the answer to what is busy."""
        if self.answer_state != "busy":
            return
        self.answer_state = "done" if result is Refusal.NONE else "failed"
        self.answer_result = result
