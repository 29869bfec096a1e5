"""Pneumatic force sensor as a field instrument: force over Modbus and CAN, with its uncertainty.

Programs use the names in `__all__`. They are loaded at their first use, so that the import is fast.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pneuforce import aio, testing
    from pneuforce.client.address import connect
    from pneuforce.client.details import Details, LatchedFault
    from pneuforce.client.force import ForceEstimate, force
    from pneuforce.client.holding import Hold
    from pneuforce.client.measurement import Measurement, State, Status
    from pneuforce.client.recording import Recording
    from pneuforce.client.sensor import ForceSensor
    from pneuforce.errors import (
        AlreadyHeld,
        ClientError,
        ConfigurationError,
        ConnectionFailed,
        ConnectionLost,
        HoldEnded,
        InvalidForce,
        PneuforceError,
        ReadOnlySensor,
        Rejected,
        SensorClosed,
        Tripped,
        UsageError,
        VentFailed,
        VentNotConfirmed,
    )
    from pneuforce.registers.map_hash import MAP_HASH

    __version__: str

__all__ = [
    "MAP_HASH",
    "AlreadyHeld",
    "ClientError",
    "ConfigurationError",
    "ConnectionFailed",
    "ConnectionLost",
    "Details",
    "ForceEstimate",
    "ForceSensor",
    "Hold",
    "HoldEnded",
    "InvalidForce",
    "LatchedFault",
    "Measurement",
    "PneuforceError",
    "ReadOnlySensor",
    "Recording",
    "Rejected",
    "SensorClosed",
    "State",
    "Status",
    "Tripped",
    "UsageError",
    "VentFailed",
    "VentNotConfirmed",
    "aio",
    "connect",
    "force",
    "testing",
]

#: Module of each public name. Names that are not listed are exceptions.
_MODULES = {
    "Details": "client.details",
    "ForceEstimate": "client.force",
    "ForceSensor": "client.sensor",
    "Hold": "client.holding",
    "LatchedFault": "client.details",
    "MAP_HASH": "registers.map_hash",
    "Measurement": "client.measurement",
    "Recording": "client.recording",
    "State": "client.measurement",
    "Status": "client.measurement",
    "connect": "client.address",
    "force": "client.force",
}
_SUBMODULES = ("aio", "testing")


if not TYPE_CHECKING:  # otherwise a type checker would accept every name

    def __getattr__(name: str) -> Any:
        """Load a public name at its first use (PEP 562)."""
        if name == "__version__":
            return import_module("importlib.metadata").version(__name__)
        if name not in __all__:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        if name in _SUBMODULES:
            return import_module(f"{__name__}.{name}")
        value = getattr(import_module(f"{__name__}.{_MODULES.get(name, 'errors')}"), name)
        globals()[name] = value
        return value


def __dir__() -> list[str]:
    """Return the public names."""
    return sorted([*__all__, "__version__"])
