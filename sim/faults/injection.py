"""Puts faults into a running rig, and takes them out again."""

from __future__ import annotations

from collections.abc import Mapping
from difflib import get_close_matches
from functools import reduce
from typing import Any

from sim.faults.catalogue import CATALOGUE
from sim.faults.kind import FaultKind, Given


class Refused(ValueError):
    """A fault that does not exist, or with arguments that it does not take."""


class Faults:
    """The faults of one rig. What they change is changed back to what it was when this was made."""

    def __init__(self, world: object) -> None:
        """`world` has the attributes `rig` and `line`, at which the paths of the catalogue begin."""
        self._world = world
        self._healthy = {path: _read(world, path) for kind in CATALOGUE.values() for path in kind.sets}
        self._present: dict[str, Mapping[str, float]] = {}

    @property
    def present(self) -> Mapping[str, Mapping[str, float]]:
        """The faults that are in now, with their arguments."""
        return self._present

    def put_in(self, name: str, arguments: Mapping[str, Any] | None = None) -> None:
        """Put a fault in, instead of any that is in and changes the same.

        Raises Refused, before anything is changed.
        """
        values = checked(name, arguments or {})
        kind = CATALOGUE[name]
        for other in [other for other in self._present if _same(kind, CATALOGUE[other])]:
            self.take_out(other)
        for path, value in kind.sets.items():
            _set(self._world, path, values[value.argument] if isinstance(value, Given) else value)
        if kind.does:
            _read(self._world, kind.does)(*values.values())
        if kind.lasts:
            self._present[name] = values

    def take_out(self, name: str) -> None:
        """Take a fault out; nothing happens where it is not in. Raises Refused where there is none such."""
        kind = kind_of(name)
        if self._present.pop(name, None) is None:
            return
        for path in kind.sets:
            _set(self._world, path, self._healthy[path])
        if kind.undoes:
            _read(self._world, kind.undoes)()


def kind_of(name: str) -> FaultKind:
    """The fault of this name. Raises Refused."""
    if name not in CATALOGUE:
        near = f" (near: {', '.join(found)})" if (found := get_close_matches(name, CATALOGUE)) else ""
        raise Refused(f"there is no fault {name!r}{near}; pneuforce fault --list shows all")
    return CATALOGUE[name]


def checked(name: str, arguments: Mapping[str, Any]) -> dict[str, float]:
    """The arguments of a fault, with the usual value of each that is not given. Raises Refused."""
    declared = {argument.name: argument for argument in kind_of(name).arguments}
    unknown = [given for given in arguments if given not in declared]
    if unknown:
        raise Refused(f"{name} takes {', '.join(declared) or 'no arguments'}, not {unknown[0]!r}")
    values = {argument.name: argument.usual for argument in declared.values()} | dict(arguments)
    for argument in declared.values():
        if not _within(values[argument.name], argument.low, argument.high):
            span = f"{argument.low:g} to {argument.high:g} {argument.unit}"
            raise Refused(f"{argument.name} of {name} is a number from {span}")
        if argument.whole:
            values[argument.name] = round(values[argument.name])
    return values


def _within(value: object, low: float, high: float) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and low <= value <= high


def _same(kind: FaultKind, other: FaultKind) -> bool:
    """Whether two faults change the same thing."""
    return bool(kind.sets.keys() & other.sets.keys()) or (bool(kind.does) and kind.does == other.does)


def _read(world: object, path: str) -> Any:
    return reduce(getattr, path.split("."), world)


def _set(world: object, path: str, value: Any) -> None:
    owner, _, name = path.rpartition(".")
    setattr(_read(world, owner), name, value)
