"""A source that keeps what it is told: the smallest instrument that a bus can be put on."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from instrument.snapshot import Snapshot
from registers.source import Peer

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
    "state": "vented",
    "status": frozenset(("vented", "simulated", "any_failure")),
    "setpoint_kpa": float("nan"),
    "first_fault": 0,
    "active_faults": 0,
    "faults": (),
    "setpoint_requested_kpa": 5.0,
    "force_limit_n": 5.0,
    "mode": "vent",
    "lease_holder": "none",
    "refusal": "none",
    "command_key": 0,
    "command_code": "none",
    "command_argument": 0,
    "command_sequence": 0,
    "answer_sequence": 0,
    "answer_state": "idle",
    "answer_result": "none",
    "method": "energetic",
    "configuration_hash": 0xC0FFEE,
    "serial_number": 1234567890,
    "calibration_date": 20250131,
    "balloon_id": 9,
    "inflations": 17,
}


def nothing_refused(_peer: Peer, _values: Mapping[str, Any]) -> str:
    return "none"


class MemorySource:
    """Keeps written values, refuses by rule, and counts one sample per snapshot that is taken."""

    def __init__(self, refuse: Callable[[Peer, Mapping[str, Any]], str] = nothing_refused) -> None:
        self.values = dict(AT_REST)
        self.refuse = refuse
        self.refusals: dict[Peer, str] = {}
        self.asked: list[dict[str, Any]] = []
        self.turned_away: list[tuple[Peer, bytes, str]] = []

    def snapshot(self, peer: Peer, now_s: float) -> Snapshot:
        self.values["sample_counter"] += 1
        return Snapshot(**self.values | {"refusal": self.refusals.get(peer, "none")})

    def write(self, peer: Peer, values: Mapping[str, Any], now_s: float) -> str:
        self.asked.append(dict(values))
        reason = "none" if values == {"mode": "vent"} else self.refuse(peer, values)
        self.refusals[peer] = reason
        if reason == "none":
            self.values.update(values)
        elif values.get("mode") == "vent":
            self.values["mode"] = "vent"
        return reason

    def refused(self, peer: Peer, request: bytes, why: str, now_s: float) -> None:
        self.turned_away.append((peer, request, why))
