"""Command block of the register map: key, code, argument and sequence number, with the answer."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from pneuforce.instrument.core.lease import Peer
from pneuforce.instrument.core.reject_reason import RejectReason

#: Function that runs a command with a code and an argument. It returns NONE if the command is done, None if
#: the command is in progress, and otherwise the reject reason.
RunCommand = Callable[[str, int], RejectReason | None]


@dataclass(slots=True)
class CommandBlock:
    """Last command of one peer, or of the browsers together, and its answer."""

    key: int = 0
    code: str = "none"
    argument: int = 0
    sequence: int = 0
    answer_sequence: int = 0
    answer_state: str = "idle"
    answer_result: RejectReason = RejectReason.NONE
    _writer: Peer | None = None

    def write(self, peer: Peer, values: Mapping[str, Any], run: RunCommand) -> None:
        """Store the written fields and run the command if the sequence number is new.

        If the sequence number is unchanged, the command does not run again and its answer stays. A command
        needs a key that the same peer wrote. Each write of a sequence number clears the key.
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
        self.answer_state, self.answer_result = "busy", RejectReason.NONE
        result = run(self.code, self.argument) if unlocked else RejectReason.STATE
        if result is not None:
            self.finish(result)

    def finish(self, result: RejectReason) -> None:
        """Set the answer of a command in progress. Do nothing if no command is in progress."""
        if self.answer_state != "busy":
            return
        self.answer_state = "done" if result is RejectReason.NONE else "failed"
        self.answer_result = result
