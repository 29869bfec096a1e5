"""Storage of the parameters (CiA 301, objects 1010h and 1011h; CiA 305, store configuration), without I/O."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass

from pneuforce.registers.canopen.stored_parameters import StoredParameters, decode, encode
from pneuforce.support.counted import counted

#: Function that starts to write the parameter file, and returns at once.
WriteFile = Callable[[bytes], Future[None]]


@dataclass(slots=True)
class PendingWrite:
    """Write of the parameter file in the background."""

    stored: StoredParameters
    future: Future[None]
    succeeded: bool | None = None  #: None: not finished


class ParameterStorage:
    """Values that a master has stored.

    A file that cannot be used never prevents the start: the configuration then applies, and `problem` says
    why.
    """

    def __init__(
        self,
        configured_node_id: int = 0,
        content: bytes | None = None,
        write_file: WriteFile | None = None,
        problem: str = "",
    ) -> None:
        """Create the storage.

        `content` is the content of the file, or None if there is no file. Without `write_file`, nothing can
        be stored. `problem` says why the file could not be read.
        """
        self.stored = StoredParameters()
        self.problem = problem
        self._configured_node_id = configured_node_id
        self._write_file = write_file
        self._pending: PendingWrite | None = None
        if content is not None:
            try:
                self.stored = decode(content, configured_node_id)
            except ValueError as error:
                self.problem = str(error)

    @property
    def summary(self) -> str:
        """Return a short text for the operator: what is stored, or why it is not used."""
        if self.problem:
            return f"not used: {self.problem}"
        stored = [f"node id {self.stored.node_id}"] if self.stored.node_id else []
        stored += [counted(len(self.stored.values), "parameter")] if self.stored.values else []
        return ", ".join(stored) or "none"

    @property
    def can_store(self) -> bool:
        """Return True if there is a parameter file."""
        return self._write_file is not None

    def reject_values(self, problem: str) -> None:
        """Ignore the stored communication parameters from now on, because of this problem."""
        self.stored, self.problem = self.stored._replace(values={}), problem

    def store(self, stored: StoredParameters) -> PendingWrite | None:
        """Start to write new values; return None if another write is not finished, or if there is no file."""
        if self._write_file is None or self._pending is not None:
            return None
        self._pending = PendingWrite(stored, self._write_file(encode(stored, self._configured_node_id)))
        return self._pending

    def tick(self) -> None:
        """Finish a write that has ended. Only then, the new values apply."""
        pending = self._pending
        if pending is None or not pending.future.done():
            return
        self._pending = None
        pending.succeeded = pending.future.exception() is None
        if pending.succeeded:
            self.stored, self.problem = pending.stored, ""
