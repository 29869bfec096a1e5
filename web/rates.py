"""Rates per second, computed from the counters in two HEALTH entries."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

Health = Mapping[str, Any]

#: Counters whose increases are added for each rate. A counter: section of HEALTH, name in this section.
RATES: Mapping[str, tuple[tuple[str, str], ...]] = {
    "samples_per_s": (("rig", "samples"),),
    "modbus_requests_per_s": (("modbus_tcp", "requests"), ("modbus_rtu", "requests")),
    "modbus_exceptions_per_s": (("modbus_tcp", "exceptions"), ("modbus_rtu", "exceptions")),
    "can_sent_per_s": (("can", "sent"),),
    "can_received_per_s": (("can", "received"),),
    "rdt_records_per_s": (("rdt", "records"),),
}


class HealthReading(NamedTuple):
    """HEALTH entry with its time."""

    t_s: float
    health: Health


def with_rates(previous: HealthReading | None, current: HealthReading) -> dict[str, Any]:
    """Return HEALTH with the section "rates", and with "requests_per_s" for each Modbus TCP client.

    A rate is None if a counter is missing or was reset, or if no previous reading exists.
    """
    health = dict(current.health)
    health["rates"] = {name: _total_rate(previous, current, counters) for name, counters in RATES.items()}
    server = health.get("modbus_tcp")
    if server and server.get("clients"):
        previous_clients = {client["address"]: client for client in _clients(previous)}
        clients = [
            client | {"requests_per_s": _client_rate(previous, previous_clients, current, client)}
            for client in server["clients"]
        ]
        health["modbus_tcp"] = server | {"clients": clients}
    return health


def _clients(reading: HealthReading | None) -> list[dict[str, Any]]:
    server = reading.health.get("modbus_tcp") if reading else None
    return (server or {}).get("clients") or []


def _client_rate(
    previous: HealthReading | None,
    previous_clients: Mapping[str, Health],
    current: HealthReading,
    client: Health,
) -> float | None:
    previous_client = previous_clients.get(client["address"])
    if previous is None or previous_client is None:
        return None
    return _rate(client["requests"] - previous_client["requests"], current.t_s - previous.t_s)


def _total_rate(
    previous: HealthReading | None, current: HealthReading, counters: tuple[tuple[str, str], ...]
) -> float | None:
    if previous is None:
        return None
    available = [(section, name) for section, name in counters if current.health.get(section)]
    increase = sum(
        current.health[section].get(name, 0) - (previous.health.get(section) or {}).get(name, 0)
        for section, name in available
    )
    return _rate(increase, current.t_s - previous.t_s) if available else None


def _rate(increase: float, interval_s: float) -> float | None:
    """Return the rate per second, or None if a counter was reset."""
    return round(increase / interval_s, 2) if interval_s > 0 and increase >= 0 else None
