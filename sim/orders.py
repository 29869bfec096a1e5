"""What a control client may ask of the simulated world: a table of orders."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from sim.contacts.table import is_number
from sim.faults import Refused
from sim.plant import HARDEST_N
from sim.scenario import ScenarioError, contacts_of
from sim.world import World


class Order(NamedTuple):
    """One key of a request: which values it takes, and what it does. What it returns is the answer."""

    accepts: Callable[[Any], bool]
    expected: str
    act: Callable[[World, Any], dict[str, Any] | None]


def _names_a_fault(value: Any) -> bool:
    return (
        isinstance(value, dict)
        and isinstance(value.get("name"), str)
        and isinstance(value.get("on", True), bool)
    )


def _fault(world: World, value: Mapping[str, Any]) -> None:
    arguments = {key: given for key, given in value.items() if key not in ("name", "on")}
    if value.get("on", True):
        world.faults.put_in(value["name"], arguments)
    else:
        world.faults.take_out(value["name"])


def _faults(world: World, _: Any) -> dict[str, Any]:
    return {"faults": [{"name": name, **values} for name, values in world.faults.present.items()]}


def _work(world: World, works: bool) -> None:
    world.rig.hand.works = works


ORDERS: Mapping[str, Order] = {
    "press": Order(
        lambda v: is_number(v) and 0 <= v <= HARDEST_N,
        f"a force from 0 to {HARDEST_N:g} N",
        lambda world, force_n: world.rig.hand.press(float(force_n)),
    ),
    "release": Order(lambda v: v is True, "true", lambda world, _: world.rig.hand.release()),
    "contact": Order(
        lambda v: isinstance(v, dict),
        "an object like a contact of a scenario",
        lambda world, contact: world.rig.hand.play(contacts_of(contact)),
    ),
    "hand": Order(lambda v: isinstance(v, bool), "true or false", _work),
    "fault": Order(_names_a_fault, 'an object with "name", arguments, "on": false to take it out', _fault),
    "faults": Order(lambda v: v is True, "true", _faults),
}


def obey(world: World, key: str, value: Any) -> dict[str, Any] | None:
    """Carry out one order; its answer, if it has one. Raises Refused before anything of it is done."""
    order = ORDERS[key]
    if not order.accepts(value):
        raise Refused(f"{key} expects {order.expected}")
    try:
        return order.act(world, value)
    except ScenarioError as error:
        raise Refused(str(error)) from None
