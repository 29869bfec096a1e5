"""The command block: key, code and argument, run once for each new sequence number."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from instrument.lease import Peer
from instrument.refusal import Refusal


class Runner(Protocol):
    """What can be commanded."""

    def run(self, code: str, argument: int, now_s: float) -> Refusal | None:
        """Run a command; NONE where it is done, None where it is still busy, else why not."""
        ...


@dataclass(slots=True)
class CommandBlock:
    """What was written, and the answer to it."""

    runner: Runner
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
        unlocked, self.key = bool(self.key), 0
        if values["command_sequence"] == self.sequence:
            return
        self.sequence = self.answer_sequence = int(values["command_sequence"])
        self.answer_state, self.answer_result = "busy", Refusal.NONE
        result = self.runner.run(self.code, self.argument, now_s) if unlocked else Refusal.STATE
        if result is not None:
            self.finish(result)

    def finish(self, result: Refusal) -> None:
        """Give the answer to what is busy."""
        if self.answer_state != "busy":
            return
        self.answer_state = "done" if result is Refusal.NONE else "failed"
        self.answer_result = result
