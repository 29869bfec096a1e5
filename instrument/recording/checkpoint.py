"""Checkpoint: the complete state of a session, so that a recording can begin at any time.

A checkpoint is a pickle, and users exchange recordings. A checkpoint from a stranger must not execute code.
The unpickler therefore loads only a few containers and classes of modules that do no input or output.
"""

from __future__ import annotations

import io
import pickle
import pickletools
from importlib import import_module
from typing import Any

from pneuforce.instrument.core.session import NullSink, Session
from pneuforce.instrument.stream.entry import StreamError

#: Packages and modules whose classes may be restored. Their classes compute and do no input or output.
_ALLOWED_MODULES = (
    "pneuforce.instrument.core",
    "pneuforce.instrument.measurement",
    "pneuforce.instrument.model",
    "pneuforce.instrument.rig.board_clock",
    "pneuforce.instrument.rig.command_echo",
    "pneuforce.instrument.rig.link",
    "pneuforce.protocol.frames",
)
#: Containers and plain values from other modules that may be restored.
_ALLOWED_CLASSES = {
    ("builtins", "frozenset"),
    ("builtins", "set"),
    ("collections", "deque"),
    ("pneuforce.registers.source", "Peer"),
}
MAX_BYTES = 1_000_000  #: largest accepted checkpoint; a valid checkpoint has about 5 kB


def save_session(session: Session) -> bytes:
    """Return the state of a session without its entry sink."""
    return pickle.dumps(vars(session) | {"sink": None}, protocol=5)


def restore_session(state: bytes) -> Session:
    """Return a session with the saved state. Its entry sink discards all entries.

    Raises StreamError if the state is damaged or contains something that `save_session` does not write.
    """
    try:
        _check_memory_use(state)
        attributes = _Restorer(io.BytesIO(state)).load()
        session = Session(attributes["instrument"])
        vars(session).update(attributes, sink=NullSink())
    except StreamError:
        raise
    except Exception as error:
        raise StreamError(f"the checkpoint of the recording cannot be read: {error}") from None
    return session


def _check_memory_use(state: bytes) -> None:
    """Raise StreamError if the unpickler could reserve gigabytes of memory.

    A few bytes with an explicit memo index (opcode PUT) can cause this. `save_session` never writes explicit
    memo indices.
    """
    if len(state) > MAX_BYTES:
        raise StreamError(f"the checkpoint of the recording is too large: {len(state)} bytes")
    for opcode, _, _ in pickletools.genops(state):
        if "PUT" in opcode.name:
            raise StreamError(f"the checkpoint of the recording contains the invalid opcode {opcode.name}")


class _Restorer(pickle.Unpickler):
    def find_class(self, module: str, name: str) -> Any:
        if (module, name) in _ALLOWED_CLASSES or _is_allowed(module):
            found = getattr(import_module(module), name, None)
            if isinstance(found, type) and found.__module__ == module:
                return found
        raise StreamError(
            f"the checkpoint of the recording refers to {module}.{name}, which is not allowed there"
        )


def _is_allowed(module: str) -> bool:
    return any(module == allowed or module.startswith(allowed + ".") for allowed in _ALLOWED_MODULES)
