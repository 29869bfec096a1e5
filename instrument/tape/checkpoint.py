"""The checkpoint: the whole state of a coupling, to go on from. A recording may begin at any moment.

It is a pickle, and recordings are sent around: whoever opens one must not run what somebody else put into
it. So only classes of the instrument's own logic, and a few that only hold values, are ever looked up.
"""

from __future__ import annotations

import io
import pickle
import pickletools
from importlib import import_module
from typing import Any

from instrument.coupling import Coupling, NoTape
from instrument.tape.entry import TapeError

#: Modules whose classes may be restored. None of them does more than compute.
_OURS = (
    "arming",
    "chain",
    "commands",
    "contact",
    "core",
    "faults",
    "interlocks",
    "lag",
    "leak",
    "lease",
    "measurement",
    "model",
    "obedience",
    "operations",
    "refusal",
    "requests",
    "rig.clock",
    "rig.echo",
    "rig.frames",
    "rig.link",
    "sensor",
    "settings",
    "vented",
)
MOST_BYTES = 1_000_000  #: ours have some 5 kB
_HOLDERS = {
    ("builtins", "frozenset"),
    ("builtins", "set"),
    ("collections", "deque"),
    ("registers.source", "Peer"),
}


def freeze(coupling: Coupling) -> bytes:
    """The state of a coupling; its tape is none of it."""
    tape, coupling.tape = coupling.tape, NoTape()
    try:
        return pickle.dumps(vars(coupling) | {"tape": None}, protocol=5)
    finally:
        coupling.tape = tape


def thaw(state: bytes) -> Coupling:
    """A coupling in that state, without a tape. Raises TapeError where it is none of ours."""
    try:
        _refuse_greedy(state)
        kept = _Restorer(io.BytesIO(state)).load()
        coupling = Coupling(kept["instrument"])
        vars(coupling).update(kept, tape=NoTape())
    except TapeError:
        raise
    except Exception as error:
        raise TapeError(f"the recording's checkpoint cannot be read: {error}") from None
    return coupling


def _refuse_greedy(state: bytes) -> None:
    """A few bytes can make the unpickler reserve gigabytes: by a memo numbered by hand, as ours is not."""
    if len(state) > MOST_BYTES:
        raise TapeError(f"the recording's checkpoint has {len(state)} bytes: it is none of ours")
    for opcode, _, _ in pickletools.genops(state):
        if "PUT" in opcode.name:
            raise TapeError("the recording's checkpoint numbers its parts by hand: it is none of ours")


class _Restorer(pickle.Unpickler):
    def find_class(self, module: str, name: str) -> Any:
        if (module, name) in _HOLDERS or _is_ours(module):
            found = getattr(import_module(module), name, None)
            if isinstance(found, type) and found.__module__ == module:
                return found
        raise TapeError(f"the recording's checkpoint asks for {module}.{name}, which is nothing of its own")


def _is_ours(module: str) -> bool:
    own = module.removeprefix("instrument.")
    return own != module and any(own == name or own.startswith(name + ".") for name in _OURS)
