"""Injection of faults into a running rig, and their removal."""

from __future__ import annotations

from collections.abc import Mapping
from functools import reduce
from typing import Any

from pneuforce.errors import ConfigurationError
from pneuforce.sim.faults.catalogue import CATALOGUE
from pneuforce.sim.faults.kind import FaultKind, FromArgument
from pneuforce.sim.faults.similar import similar_names


class SimulatorRequestError(ConfigurationError):
    """Invalid request to the simulator, for example an unknown fault or an argument out of range."""


class FaultInjector:
    """Injector for the faults of one rig.

    Removal of a fault restores the values that its attributes had when the injector was created.
    """

    def __init__(self, world: object) -> None:
        """Read the values of the rig without faults.

        The attribute paths of the catalogue start at `world`, which has the attributes `rig` and `line`.
        """
        self._world = world
        self._healthy = {path: _read(world, path) for kind in CATALOGUE.values() for path in kind.attributes}
        self._active: dict[str, Mapping[str, float]] = {}

    @property
    def active(self) -> Mapping[str, Mapping[str, float]]:
        """Return the active faults by name, with their arguments."""
        return self._active

    def inject(self, name: str, arguments: Mapping[str, Any] | None = None) -> None:
        """Inject a fault. First, remove any active fault that uses the same attribute or call.

        Raises SimulatorRequestError, before anything is changed, if the name or an argument is invalid.
        """
        values = validate_arguments(name, arguments or {})
        kind = CATALOGUE[name]
        for other in [other for other in self._active if _exclude_each_other(kind, CATALOGUE[other])]:
            self.remove(other)
        for path, value in kind.attributes.items():
            _write(self._world, path, values[value.argument] if isinstance(value, FromArgument) else value)
        if kind.call:
            _read(self._world, kind.call)(*values.values())
        if kind.is_persistent:
            self._active[name] = values

    def remove(self, name: str) -> None:
        """Remove a fault. Do nothing if the fault is not active.

        Raises SimulatorRequestError if the name is unknown.
        """
        kind = fault_kind(name)
        if self._active.pop(name, None) is None:
            return
        for path in kind.attributes:
            _write(self._world, path, self._healthy[path])
        if kind.undo_call:
            _read(self._world, kind.undo_call)()


def fault_kind(name: str) -> FaultKind:
    """Return the fault of this name. Raises SimulatorRequestError if the name is unknown."""
    if name not in CATALOGUE:
        similar = similar_names(name)
        near = f" (similar: {', '.join(similar)})" if similar else ""
        if name == "off":
            near = " (to remove a fault, state its name and --off: pneuforce sim fault leak --off)"
        names = "" if similar or name == "off" else f": {', '.join(CATALOGUE)}"
        raise SimulatorRequestError(
            f"there is no fault {name!r}{near}: pneuforce sim fault --list shows all faults{names}"
        )
    return CATALOGUE[name]


def validate_arguments(name: str, arguments: Mapping[str, Any]) -> dict[str, float]:
    """Return the arguments of a fault, with the default of each missing argument.

    Raises SimulatorRequestError if the fault is unknown, or if an argument is unknown or out of range.
    """
    declared = {argument.name: argument for argument in fault_kind(name).arguments}
    unknown = [given for given in arguments if given not in declared]
    if unknown:
        raise SimulatorRequestError(
            f"{name} takes {', '.join(declared) or 'no arguments'}, not {unknown[0]!r}"
        )
    values = {argument.name: argument.default for argument in declared.values()} | dict(arguments)
    for argument in declared.values():
        if not _in_range(values[argument.name], argument.minimum, argument.maximum):
            span = f"{argument.minimum:g} to {argument.maximum:g} {argument.unit}"
            raise SimulatorRequestError(f"{argument.name} of {name} must be a number from {span}")
        if argument.integer:
            values[argument.name] = round(values[argument.name])
    return values


def _in_range(value: object, minimum: float, maximum: float) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and minimum <= value <= maximum


def _exclude_each_other(kind: FaultKind, other: FaultKind) -> bool:
    """Return True if two faults change the same attribute or use the same call."""
    return bool(kind.attributes.keys() & other.attributes.keys()) or (
        bool(kind.call) and kind.call == other.call
    )


def _read(world: object, path: str) -> Any:
    return reduce(getattr, path.split("."), world)


def _write(world: object, path: str, value: Any) -> None:
    parent, _, name = path.rpartition(".")
    setattr(_read(world, parent), name, value)
