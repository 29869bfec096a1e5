"""Fake source for tests. The test sets its snapshot and its reject reason; the source records all writes."""

import math
from typing import get_type_hints

from pneuforce.instrument.core.snapshot import Snapshot
from pneuforce.registers.map_hash import MAP_HASH

_TEXT = {
    "state": "holding",
    "mode": "hold",
    "ambient_source": "configured",
    "firmware_origin": "current",
    "configuration_signature": "signed",
    "calibration_signature": "no_file",
    "lease_holder": "none",
    "proof_test": "allowed",
    "reject_reason": "none",
    "command_code": "none",
    "answer_state": "idle",
    "answer_result": "none",
    "method": "energetic",
    "status": frozenset({"holding", "force_valid"}),
    "maintenance_causes": frozenset(),
    "faults": (),
    "map_hash": MAP_HASH,
}
_NUMBERS = {float: math.nan, int: 0}

SNAPSHOT = Snapshot(
    **{name: _TEXT.get(name, _NUMBERS.get(type_)) for name, type_ in get_type_hints(Snapshot).items()}
)


class FakeSource:
    """Source for a CAN node in a test without an instrument."""

    def __init__(self, **values):
        self.now = SNAPSHOT._replace(**values)
        self.reject_reason = "none"
        self.written = []
        self.rejected_writes = []
        self.rejected_in_words = []
        self.masters_lost_s = []
        self.masters_recovered_s = []

    def set(self, **values):
        """Change quantities of the snapshot."""
        self.now = self.now._replace(**values)

    def snapshot(self, peer, now_s):
        return self.now

    @property
    def discrete_state(self):
        return self.now

    @property
    def force_limit_exceeded(self):
        return "force_high_alarm" in self.now.status

    def write(self, peer, values, now_s):
        assert peer.channel == "can"
        self.written.append(dict(values))
        return self.reject_reason

    def master_lost(self, now_s):
        self.masters_lost_s.append(now_s)

    def master_recovered(self, now_s):
        self.masters_recovered_s.append(now_s)

    def log_rejected_write(self, peer, rejected, now_s):
        assert peer.channel == "can"
        self.rejected_writes.append((rejected.request, rejected.reason))
        self.rejected_in_words.append((rejected.written, rejected.allowed))
