"""Limits of the board: conditions that must be true in certain states. A violation trips the board."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Set
from typing import NamedTuple

from pneuforce.protocol.frames import BoardState, Fault
from pneuforce.protocol.limits import (
    FILL_KPA_PER_S,
    HARD_LIMIT_KPA,
    HELD,
    OCCLUDED_TIME_RATIO,
    PRESSURISED,
    SUPPLY_MV,
)
from pneuforce.sim.board.board_status import BoardStatus
from pneuforce.sim.board.monitors import vented_kpa
from pneuforce.sim.board.states import ALL_STATES, EMPTYING, FILL, FILLING, SAFE
from pneuforce.sim.board.supply import SUPPLY_SAMPLES

OVERSHOOT_KPA = 0.5
FILLING_LIMIT_KPA = 12.5
FROZEN_S = 0.2
LIMIT_POINT_KPA = 0.1
#: Distance below the setpoint at which a fast fall is a burst [kPa]. The release of a contact is a fast fall
#: too, but that fall ends at the setpoint.
BURST_BELOW_KPA = 0.5
VENT_SHUT_S = 3.0
INLET_LEAK_KPA = 0.3
SETPOINT_TIMEOUT_S = 15.0
MAX_VALVE_ACTIONS = 20
MAX_TOP_UPS = 3

Condition = Callable[[BoardStatus], bool]


class Limit(NamedTuple):
    """Condition that must be true in `states`. `samples` violations in a row latch `fault`."""

    fault: Fault
    states: Set[BoardState]
    samples: int
    condition: Condition


def sensor_ok(status: BoardStatus) -> bool:
    """Return True if the sensor is neither open nor shorted."""
    return status.reading.sensor_ok


def supply_ok(status: BoardStatus) -> bool:
    """Return True if the mean supply voltage of sensor and valves is within 4.75–5.25 V."""
    return SUPPLY_MV[0] <= status.supply.mean_mv <= SUPPLY_MV[1]


def below_hard_limit(status: BoardStatus) -> bool:
    """Return True if the pressure is at most the hard limit, which no host can raise."""
    return status.reading.pressure_kpa <= HARD_LIMIT_KPA


def below_filling_limit(status: BoardStatus) -> bool:
    """Return True if the pressure is at most 0.5 kPa above the setpoint and at most 12.5 kPa.

    Until the pressure has fallen to a lower setpoint, the lowest pressure so far replaces the setpoint.
    """
    highest_kpa = max(status.setpoint_kpa, status.filling.lowest_kpa) + OVERSHOOT_KPA
    return status.reading.pressure_kpa <= min(highest_kpa, FILLING_LIMIT_KPA)


def below_contact_limit(status: BoardStatus) -> bool:
    """Return True if the pressure is at most the contact limit that the host has set."""
    return status.reading.pressure_kpa <= status.contact_limit_kpa


def balloon_intact(status: BoardStatus) -> bool:
    """Return False if the pressure has fallen by half in 100 ms, to a value below the setpoint.

    A fast fall that ends at the setpoint is not a burst, but the release of a contact.
    """
    now_kpa = status.reading.pressure_kpa
    return now_kpa >= 0.5 * status.reading.past_kpa or now_kpa >= status.setpoint_kpa - BURST_BELOW_KPA


def sensor_moves(status: BoardStatus) -> bool:
    """Return False if the ADC sum is constant although an open valve must change the pressure."""
    emptying = status.valves == SAFE and status.reading.pressure_kpa > vented_kpa(status.reading)
    must_move = emptying or status.valves == FILL
    return not must_move or status.reading.unchanged_s < FROZEN_S


def stays_vented(status: BoardStatus) -> bool:
    """Return True if the inlet does not leak: the pressure of the vented balloon stays low."""
    return status.reading.pressure_kpa <= vented_kpa(status.reading) + INLET_LEAK_KPA


def setpoint_in_time(status: BoardStatus) -> bool:
    """Return True if the time and the valve actions since the new setpoint are within their limits."""
    return (
        status.filling.elapsed_s <= SETPOINT_TIMEOUT_S and status.filling.valve_actions <= MAX_VALVE_ACTIONS
    )


def fill_rate_plausible(status: BoardStatus) -> bool:
    """Return True if the pressure rises no faster than the filling of tubes and balloon allows.

    If the tube is occluded, the gas fills the tubes alone, and the pressure rises faster.
    """
    return status.inlet.rise_kpa_per_s <= FILL_KPA_PER_S / OCCLUDED_TIME_RATIO


def vent_rate_plausible(status: BoardStatus) -> bool:
    """Return True if the pressure falls no faster than the emptying of tubes and balloon allows.

    If the tube is occluded, the vent empties the tubes alone, and the pressure falls faster.
    """
    return status.emptying.halving_time_ratio >= OCCLUDED_TIME_RATIO


def not_past_limit_point(status: BoardStatus) -> bool:
    """Return False if the pressure falls although the inlet is open: the limit point was passed."""
    return status.inlet.fallen_kpa <= LIMIT_POINT_KPA


def pressure_rises(status: BoardStatus) -> bool:
    """Return False if the pressure does not rise although the inlet is open."""
    return not status.inlet.stalled


def pressure_falls(status: BoardStatus) -> bool:
    """Return False if the pressure does not fall although the vent is open and the balloon is not empty."""
    return status.vent.no_fall_s <= VENT_SHUT_S


def few_top_ups(status: BoardStatus) -> bool:
    """Return False if a top-up is due, but three top-ups were made within the last ten minutes."""
    return not status.top_ups.due or status.top_ups.recent_count < MAX_TOP_UPS


def host_in_time(status: BoardStatus) -> bool:
    """Return True if the last command is not older than the timeout that the host requested."""
    return status.since_command_s <= status.host_timeout_s


def overpressure_gone(status: BoardStatus) -> bool:
    """Return True if the pressure is at most 12.5 kPa, the limit during an inflation."""
    return status.reading.pressure_kpa <= FILLING_LIMIT_KPA


def vent_verified(status: BoardStatus) -> bool:
    """Return True if the measured pressure shows that the balloon is empty."""
    return status.vent.verified


def host_reconnected(status: BoardStatus) -> bool:
    """Return True if the host is active again."""
    return status.host_active


HOLDING, VENTED = frozenset({BoardState.HOLDING}), frozenset({BoardState.VENTED})
VENTING = frozenset({BoardState.VENTING})

LIMITS: tuple[Limit, ...] = (
    Limit(Fault.SENSOR, ALL_STATES, 5, sensor_ok),
    Limit(Fault.SUPPLY_VOLTAGE, ALL_STATES, SUPPLY_SAMPLES, supply_ok),
    Limit(Fault.OVERPRESSURE, ALL_STATES, 1, below_hard_limit),
    Limit(Fault.OVERPRESSURE, FILLING, 3, below_filling_limit),
    Limit(Fault.OVERPRESSURE, HELD, 3, below_contact_limit),
    Limit(Fault.BURST, HELD, 3, balloon_intact),
    Limit(Fault.LIMIT_POINT, FILLING, 1, not_past_limit_point),
    Limit(Fault.SENSOR_FROZEN, ALL_STATES, 1, sensor_moves),
    Limit(Fault.NO_RISE, FILLING, 1, pressure_rises),
    Limit(Fault.INLET_OPEN, VENTED, 50, stays_vented),
    Limit(Fault.VENT_SHUT, EMPTYING, 1, pressure_falls),
    Limit(Fault.OCCLUSION, FILLING, 10, fill_rate_plausible),
    Limit(Fault.OCCLUSION, VENTING, 1, vent_rate_plausible),
    Limit(Fault.LEAK, HOLDING, 1, few_top_ups),
    Limit(Fault.SETPOINT_TIMEOUT, FILLING, 1, setpoint_in_time),
    Limit(Fault.HOST_SILENT, PRESSURISED, 1, host_in_time),
)

#: Condition under which each latched fault may be cleared. All other faults may always be cleared, because
#: their causes cannot be measured while the valves are SAFE.
CLEAR_CONDITIONS: Mapping[Fault, Condition] = {
    Fault.SENSOR: sensor_ok,
    Fault.SUPPLY_VOLTAGE: supply_ok,
    Fault.OVERPRESSURE: overpressure_gone,
    Fault.SENSOR_FROZEN: sensor_moves,
    Fault.INLET_OPEN: vent_verified,
    Fault.VENT_SHUT: vent_verified,
    Fault.HOST_SILENT: host_reconnected,
}
