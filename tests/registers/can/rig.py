"""A source whose snapshot and refusal a test sets at will, and that remembers what was written."""

import math
from dataclasses import fields, replace

from instrument.snapshot import Snapshot

_TEXT = {
    "state": "holding",
    "mode": "hold",
    "lease_holder": "none",
    "refusal": "none",
    "command_code": "none",
    "answer_state": "idle",
    "answer_result": "none",
    "method": "energetic",
    "status": frozenset({"holding", "force_valid"}),
    "faults": (),
}
_NUMBERS = {"float": math.nan, "int": 0}

SNAPSHOT = Snapshot(**{f.name: _TEXT.get(f.name, _NUMBERS.get(str(f.type))) for f in fields(Snapshot)})


class Rig:
    def __init__(self, **values):
        self.now = replace(SNAPSHOT, **values)
        self.refusal = "none"
        self.written = []

    def set(self, **values):
        self.now = replace(self.now, **values)

    def snapshot(self, peer, now_s):
        return self.now

    def write(self, peer, values, now_s):
        assert peer.channel == "can"
        self.written.append(dict(values))
        return self.refusal
