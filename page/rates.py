"""Rates, from what an instrument has counted until two moments."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

Health = Mapping[str, Any]

#: Each rate, and the counters that it sums: their section of HEALTH and their name in it.
RATES: Mapping[str, tuple[tuple[str, str], ...]] = {
    "samples_per_s": (("rig", "samples"),),
    "modbus_requests_per_s": (("modbus_tcp", "requests"), ("modbus_rtu", "requests")),
    "modbus_exceptions_per_s": (("modbus_tcp", "exceptions"), ("modbus_rtu", "exceptions")),
    "can_sent_per_s": (("can", "sent"),),
    "can_received_per_s": (("can", "received"),),
}


class Counted(NamedTuple):
    """What was counted until a moment."""

    t_s: float
    health: Health


def with_rates(before: Counted | None, now: Counted) -> dict[str, Any]:
    """HEALTH with "rates", and each Modbus client with "requests_per_s"; None for one not known yet."""
    health = dict(now.health)
    health["rates"] = {name: _summed(before, now, of) for name, of in RATES.items()}
    server = health.get("modbus_tcp")
    if server and server.get("clients"):
        asked = {client["address"]: client for client in _clients(before)}
        clients = [
            client | {"requests_per_s": _client_rate(before, asked, now, client)}
            for client in server["clients"]
        ]
        health["modbus_tcp"] = server | {"clients": clients}
    return health


def _clients(before: Counted | None) -> list[dict[str, Any]]:
    server = before.health.get("modbus_tcp") if before else None
    return (server or {}).get("clients") or []


def _client_rate(
    before: Counted | None, asked: Mapping[str, Health], now: Counted, client: Health
) -> float | None:
    then = asked.get(client["address"])
    if before is None or then is None:
        return None
    return _rate(client["requests"] - then["requests"], now.t_s - before.t_s)


def _summed(before: Counted | None, now: Counted, counters: tuple[tuple[str, str], ...]) -> float | None:
    if before is None:
        return None
    served = [(part, name) for part, name in counters if now.health.get(part)]
    more = sum(
        now.health[part].get(name, 0) - (before.health.get(part) or {}).get(name, 0) for part, name in served
    )
    return _rate(more, now.t_s - before.t_s) if served else None


def _rate(more: float, passed_s: float) -> float | None:
    """None where the counters began anew."""
    return round(more / passed_s, 2) if passed_s > 0 and more >= 0 else None
