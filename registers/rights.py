"""Rights to write: names for groups of quantities, which the configuration gives to roles."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

#: Quantities that each right allows to write. Every client may read and vent.
RIGHTS: Mapping[str, frozenset[str]] = {
    "setpoint": frozenset({"setpoint_requested_kpa"}),
    "mode": frozenset({"mode"}),
    "lease": frozenset({"lease_s"}),
    "commands": frozenset({"command_key", "command_code", "command_argument", "command_sequence"}),
    "alarms": frozenset({"force_limit_n", "force_limit_2_n", "alarm_hysteresis_n", "alarm_delay_s"}),
    "pressures": frozenset({"reference_pressure_kpa", "ambient_pressure_kpa"}),
    "proof_test": frozenset({"proof_test"}),
}
VIEWER = "viewer"  #: role of a client without a role that the configuration knows
DEFAULT_ROLES: Mapping[str, tuple[str, ...]] = {VIEWER: (), "operator": tuple(RIGHTS)}


def writable_quantities(rights: Iterable[str]) -> frozenset[str]:
    """Return the quantities that a role with these rights may write. Raises KeyError for an unknown right."""
    return frozenset().union(*(RIGHTS[right] for right in rights))
