"""Source that stores written values: the smallest instrument for tests of a bus server."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from pneuforce.instrument.core.snapshot import Snapshot
from pneuforce.registers.source import Peer
from pneuforce.support.rejected_write import RejectedWrite

AT_REST: dict[str, Any] = {
    **dict.fromkeys(Snapshot._fields, 0.0),
    "force_n": 1.25,
    "force_std_n": 0.02,
    "pressure_kpa": 8.5,
    "radius_mm": 8.125,
    "rise_kpa": float("nan"),
    "age_s": 0.004,
    "delay_s": float("nan"),
    "sample_counter": 70000,
    "contact_counter": 3,
    "peak_counter": 4,
    "state": "vented",
    "status": frozenset(("vented", "simulated", "any_failure")),
    "setpoint_kpa": float("nan"),
    "first_out_fault": 0,
    "active_fault_count": 0,
    "latched_faults_1": 0,
    "latched_faults_2": 0,
    "faults": (),
    "setpoint_requested_kpa": 5.0,
    "force_limit_n": 5.0,
    "force_limit_2_n": 10.0,
    "mode": "vent",
    "lease_holder": "none",
    "ambient_source": "configured",
    "maintenance_causes": frozenset(),
    "firmware_origin": "current",
    "configuration_signature": "signed",
    "calibration_signature": "no_file",
    "proof_test": "allowed",
    "reject_reason": "none",
    "command_key": 0,
    "command_code": "none",
    "command_argument": 0,
    "command_sequence": 0,
    "answer_sequence": 0,
    "answer_state": "idle",
    "answer_result": "none",
    "method": "energetic",
    "configuration_hash": 0xC0FFEE,
    "map_hash": 0xFACADE,
    "serial_number": 1234567890,
    "calibration_date": 20250131,
    "balloon_id": 9,
    "inflation_count": 17,
}


def accept_all(_peer: Peer, _values: Mapping[str, Any]) -> str:
    return "none"


class MemorySource:
    """Source that stores written values. The sample counter increases by 1 with each snapshot.

    `reject` returns the reject reason of a write request, or "none" to accept the request.
    """

    def __init__(self, reject: Callable[[Peer, Mapping[str, Any]], str] = accept_all) -> None:
        self.values = dict(AT_REST)
        self.reject = reject
        self.reject_reasons: dict[Peer, str] = {}
        self.write_requests: list[dict[str, Any]] = []
        self.rejected_writes: list[tuple[Peer, bytes, str]] = []
        self.rejected_in_words: list[tuple[str, str]] = []

    def snapshot(self, peer: Peer, now_s: float) -> Snapshot:
        self.values["sample_counter"] += 1
        return Snapshot(**self.values | {"reject_reason": self.reject_reasons.get(peer, "none")})

    def write(self, peer: Peer, values: Mapping[str, Any], now_s: float) -> str:
        self.write_requests.append(dict(values))
        reason = "none" if values == {"mode": "vent"} else self.reject(peer, values)
        self.reject_reasons[peer] = reason
        if reason == "none":
            self.values.update(values)
        elif values.get("mode") == "vent":
            self.values["mode"] = "vent"
        return reason

    def log_rejected_write(self, peer: Peer, rejected: RejectedWrite, now_s: float) -> None:
        self.rejected_writes.append((peer, rejected.request, rejected.reason))
        self.rejected_in_words.append((rejected.written, rejected.allowed))
