"""Requests of a control client: a table of keys, allowed values and actions."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from pneuforce.sim.contacts.scenario_table import is_number
from pneuforce.sim.contacts.tool import MAX_SPEED_MM_PER_S
from pneuforce.sim.faults import SimulatorRequestError
from pneuforce.sim.faults.kind import format_active
from pneuforce.sim.plants.plant import MAX_PUSH_N
from pneuforce.sim.scenario import ScenarioError, contacts_of, tool_of
from pneuforce.sim.world import World


class ControlRequest(NamedTuple):
    """One kind of request: the allowed values, and the action, which returns the answer or None."""

    is_valid: Callable[[Any], bool]
    expected: str  #: the allowed values in words, for the error message
    execute: Callable[[World, Any], dict[str, Any] | None]


def _is_fault(value: Any) -> bool:
    return (
        isinstance(value, dict)
        and isinstance(value.get("name"), str)
        and isinstance(value.get("on", True), bool)
    )


def _fault(world: World, value: Mapping[str, Any]) -> None:
    arguments = {key: argument for key, argument in value.items() if key not in ("name", "on")}
    if value.get("on", True):
        world.faults.inject(value["name"], arguments)
    else:
        _remove_fault(world, value["name"])


def _remove_fault(world: World, name: str) -> None:
    """Remove an active fault. Raises SimulatorRequestError if the fault is unknown or not active."""
    was_active = name in world.faults.active
    world.faults.remove(name)
    if not was_active:
        active = ", ".join(format_active(other, **values) for other, values in world.faults.active.items())
        raise SimulatorRequestError(f"{name} was not active; active: {active or 'no fault'}")


def _faults(world: World, _: Any) -> dict[str, Any]:
    return {"faults": [{"name": name, **values} for name, values in world.faults.active.items()]}


def _play_phases(world: World, plays_phases: bool) -> None:
    world.rig.hand.plays_phases = plays_phases


def _move(world: World, speed_mm_per_s: float) -> None:
    if not world.rig.hand.move(float(speed_mm_per_s)):
        raise SimulatorRequestError("speed_mm_per_s requires a robot: send the request robot first")


REQUESTS: Mapping[str, ControlRequest] = {
    "press": ControlRequest(
        lambda v: is_number(v) and 0 <= v <= MAX_PUSH_N,
        f"a force from 0 to {MAX_PUSH_N:g} N",
        lambda world, force_n: world.rig.hand.press(float(force_n)),
    ),
    "release": ControlRequest(lambda v: v is True, "true", lambda world, _: world.rig.hand.release()),
    "contact": ControlRequest(
        lambda v: isinstance(v, dict),
        "an object with the keys of a contact in a scenario",
        lambda world, contact: world.rig.hand.play(contacts_of(contact)),
    ),
    "robot": ControlRequest(
        lambda v: isinstance(v, dict),
        "an object with distance_mm and tissue",
        lambda world, table: world.rig.hand.give_to_robot(tool_of(table)),
    ),
    "speed_mm_per_s": ControlRequest(
        lambda v: is_number(v) and abs(v) <= MAX_SPEED_MM_PER_S,
        f"a speed from -{MAX_SPEED_MM_PER_S:g} to {MAX_SPEED_MM_PER_S:g} mm/s",
        _move,
    ),
    "hand": ControlRequest(lambda v: isinstance(v, bool), "true or false", _play_phases),
    "fault": ControlRequest(
        _is_fault, 'an object with "name", and arguments, or "on": false to remove the fault', _fault
    ),
    "faults": ControlRequest(lambda v: v is True, "true", _faults),
}


def execute_request(world: World, key: str, value: Any) -> dict[str, Any] | None:
    """Execute one request. Return its answer, or None.

    Raises SimulatorRequestError if the value is invalid. The request then has no effect.
    """
    request = REQUESTS[key]
    if not request.is_valid(value):
        raise SimulatorRequestError(f"{key} expects {request.expected}")
    try:
        return request.execute(world, value)
    except ScenarioError as error:
        raise SimulatorRequestError(f"{key}: {error}") from None
