"""The limits: what is allowed in which state. What is not allowed trips the board."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Set
from typing import NamedTuple

from instrument.rig.frames import BoardState, Fault
from instrument.rig.limits import FILL_KPA_PER_S, HARD_LIMIT_KPA, OCCLUDED_SHARE, PRESSURISED, SUPPLY_MV
from sim.board.situation import Situation
from sim.board.states import EMPTYING, EVERY, FILL, FILLING, SAFE
from sim.board.supply import SUPPLY_SAMPLES
from sim.board.watches import vented_kpa

OVERSHOOT_KPA = 0.5
FILLING_LIMIT_KPA = 12.5
STUCK_S = 0.2
LIMIT_POINT_KPA = 0.1
#: A release ends at the setpoint; a burst goes on.
BURST_BELOW_KPA = 0.5
VENT_SHUT_S = 3.0
INLET_LEAK_KPA = 0.3
TIMEOUT_S = 15.0
MOST_ACTIONS = 20
MOST_TOP_UPS = 3

Allowed = Callable[[Situation], bool]


class Limit(NamedTuple):
    """What must hold in `states`; broken on `samples` in a row, `fault` is latched."""

    fault: Fault
    states: Set[BoardState]
    samples: int
    allowed: Allowed


def alive(s: Situation) -> bool:
    """The sensor is neither open nor short."""
    return s.reading.alive


def supplied(s: Situation) -> bool:
    """The mean supply of sensor and valves is in its span."""
    return SUPPLY_MV[0] <= s.supply.mean_mv <= SUPPLY_MV[1]


def below_hard_limit(s: Situation) -> bool:
    """No host can raise this one."""
    return s.reading.pressure_kpa <= HARD_LIMIT_KPA


def below_filling_limit(s: Situation) -> bool:
    """On the way down to a lower setpoint the limit comes down with the pressure."""
    highest_kpa = max(s.setpoint_kpa, s.filling.lowest_kpa) + OVERSHOOT_KPA
    return s.reading.pressure_kpa <= min(highest_kpa, FILLING_LIMIT_KPA)


def below_contact_limit(s: Situation) -> bool:
    """The locked balloon is pressed no harder than the host allows."""
    return s.reading.pressure_kpa <= s.contact_limit_kpa


def intact(s: Situation) -> bool:
    """The locked pressure did not fall by half in 100 ms, or only back from a contact."""
    now = s.reading.pressure_kpa
    return now >= 0.5 * s.reading.before_kpa or now >= s.setpoint_kpa - BURST_BELOW_KPA


def moving(s: Situation) -> bool:
    """The ADC sum moves while a valve is open and the pressure must."""
    emptying = s.valves == SAFE and s.reading.pressure_kpa > vented_kpa(s.reading)
    must_move = emptying or s.valves == FILL
    return not must_move or s.reading.unmoved_s < STUCK_S


def inlet_shut(s: Situation) -> bool:
    """A vented rig stays vented."""
    return s.reading.pressure_kpa <= vented_kpa(s.reading) + INLET_LEAK_KPA


def in_time(s: Situation) -> bool:
    """The setpoint is reached in time and without endless clicking."""
    return s.filling.elapsed_s <= TIMEOUT_S and s.filling.actions <= MOST_ACTIONS


def fills_slowly(s: Situation) -> bool:
    """The pressure rises as fast as where tubes and balloon are filled, not the tubes alone."""
    return s.inlet.rise_kpa_per_s <= FILL_KPA_PER_S / OCCLUDED_SHARE


def empties_slowly(s: Situation) -> bool:
    """The pressure falls as fast as where tubes and balloon are emptied, not the tubes alone."""
    return s.emptying.halved_share >= OCCLUDED_SHARE


def keeps_rising(s: Situation) -> bool:
    """With the inlet open the pressure does not fall: past the limit point it would."""
    return s.inlet.fallen_kpa <= LIMIT_POINT_KPA


def rises(s: Situation) -> bool:
    """The open inlet brings gas."""
    return not s.inlet.stalled


def empties(s: Situation) -> bool:
    """With the vent open the pressure falls until the rig is empty."""
    return s.vent.unmoved_s <= VENT_SHUT_S


def keeps_gas(s: Situation) -> bool:
    """What leaks out of the band is topped up a few times only."""
    return not s.top_ups.due or s.top_ups.recent < MOST_TOP_UPS


def host_speaks(s: Situation) -> bool:
    """The host was heard within the time that it asked for itself."""
    return s.silent_s <= s.vent_after_s


def overpressure_gone(s: Situation) -> bool:
    """The pressure is one that an inflation may have."""
    return s.reading.pressure_kpa <= FILLING_LIMIT_KPA


def empty(s: Situation) -> bool:
    """The rig is vented, and verified so."""
    return s.vent.verified


def heard(s: Situation) -> bool:
    """The host has spoken lately."""
    return s.heard


HOLDING, VENTED = frozenset({BoardState.HOLDING}), frozenset({BoardState.VENTED})
VENTING = frozenset({BoardState.VENTING})

LIMITS: tuple[Limit, ...] = (
    Limit(Fault.SENSOR, EVERY, 5, alive),
    Limit(Fault.SUPPLY_VOLTAGE, EVERY, SUPPLY_SAMPLES, supplied),
    Limit(Fault.OVERPRESSURE, EVERY, 1, below_hard_limit),
    Limit(Fault.OVERPRESSURE, FILLING, 3, below_filling_limit),
    Limit(Fault.OVERPRESSURE, HOLDING, 3, below_contact_limit),
    Limit(Fault.BURST, HOLDING, 3, intact),
    Limit(Fault.LIMIT_POINT, FILLING, 1, keeps_rising),
    Limit(Fault.STUCK, EVERY, 1, moving),
    Limit(Fault.NO_RISE, FILLING, 1, rises),
    Limit(Fault.INLET_OPEN, VENTED, 50, inlet_shut),
    Limit(Fault.VENT_SHUT, EMPTYING, 1, empties),
    Limit(Fault.OCCLUSION, FILLING, 10, fills_slowly),
    Limit(Fault.OCCLUSION, VENTING, 1, empties_slowly),
    Limit(Fault.LEAK, HOLDING, 1, keeps_gas),
    Limit(Fault.TIMEOUT, FILLING, 1, in_time),
    Limit(Fault.HOST_SILENT, PRESSURISED, 1, host_speaks),
)

#: When a latched fault may be cleared. What is not named here cannot be seen any more once the rig is SAFE.
GONE: Mapping[Fault, Allowed] = {
    Fault.SENSOR: alive,
    Fault.SUPPLY_VOLTAGE: supplied,
    Fault.OVERPRESSURE: overpressure_gone,
    Fault.STUCK: moving,
    Fault.INLET_OPEN: empty,
    Fault.VENT_SHUT: empty,
    Fault.HOST_SILENT: heard,
}
