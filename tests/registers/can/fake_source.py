"""A source whose snapshot and refusal a test sets at will, and that remembers what was written."""

import math
from typing import get_type_hints

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
_NUMBERS = {float: math.nan, int: 0}

SNAPSHOT = Snapshot(
    **{name: _TEXT.get(name, _NUMBERS.get(type_)) for name, type_ in get_type_hints(Snapshot).items()}
)


class Rig:
    def __init__(self, **values):
        self.now = SNAPSHOT._replace(**values)
        self.refusal = "none"
        self.written = []
        self.turned_away = []
        self.masters_lost = []
        self.masters_back = []

    def set(self, **values):
        self.now = self.now._replace(**values)

    def snapshot(self, peer, now_s):
        return self.now

    def write(self, peer, values, now_s):
        assert peer.channel == "can"
        self.written.append(dict(values))
        return self.refusal

    def master_lost(self, now_s):
        self.masters_lost.append(now_s)

    def master_back(self, now_s):
        self.masters_back.append(now_s)

    def refused(self, peer, request, why, now_s):
        assert peer.channel == "can"
        self.turned_away.append((request, why))
