"""Proof test of the tube: evaluation of the pressure changes that two short valve pulses cause.

If the tube to the balloon is blocked, the sensor does not see a contact: the pressure stays constant, and the
instrument shows 0 N. The gas of a valve pulse shows the difference. In a free circuit, tubes and balloon take
the gas up, and the balloon grows. In a blocked circuit, only the tubes take it up, and the pressure changes
about twice as much.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Enum, auto
from typing import NamedTuple

from pneuforce.instrument.model.balloon import Balloon, Circuit
from pneuforce.instrument.model.capacity import capacity_mm3_per_kpa, tubes_capacity_mm3_per_kpa
from pneuforce.protocol.frames import BoardState, Sample, Valve
from pneuforce.protocol.limits import FILL_KPA_PER_S, HALVING_FROM_KPA, VENT_KPA_PER_S

#: Smallest allowed response, relative to the reference. A smaller response proves nothing: a valve does not
#: open, there is no gas supply, or a contact began during the test.
MIN_RATIO = 0.6
#: Smallest allowed response of the first test at a setpoint, relative to the commissioned circuit.
MIN_FIRST_RATIO = 0.4

#: Time constant of the average of the readings. The noise of the average is 1.5 Pa, and a pulse changes the
#: pressure by 60 to 100 Pa.
AVERAGE_S = 0.05

_FILL, _SAFE = int(Valve.VENT_CLOSED | Valve.INLET_OPEN), int(Valve.NONE)


class Verdict(Enum):
    """Result of a proof test."""

    PASSED = auto()
    OCCLUDED = auto()  #: both pulses changed the pressure too much
    INCONCLUSIVE = auto()  #: the pulses disagree, for example because a contact began or ended


class PulseResponse(NamedTuple):
    """Change of the pressure per opening time of each valve, positive in a working circuit."""

    inlet_kpa_per_s: float
    vent_kpa_per_s: float


def commissioned_response(pressure_kpa: float, balloon: Balloon, circuit: Circuit) -> PulseResponse:
    """Return the response of the commissioned circuit at a gauge pressure.

    The flow of the inlet is constant. The flow of the vent grows with the square root of the pressure.
    """
    share = capacity_mm3_per_kpa(HALVING_FROM_KPA, balloon, circuit) / capacity_mm3_per_kpa(
        pressure_kpa, balloon, circuit
    )
    vent_kpa_per_s = VENT_KPA_PER_S * math.sqrt(pressure_kpa / HALVING_FROM_KPA)
    return PulseResponse(FILL_KPA_PER_S * share, vent_kpa_per_s * share)


def largest_ratio(pressure_kpa: float, balloon: Balloon, circuit: Circuit) -> float:
    """Return the largest allowed response, relative to the reference.

    The limit is the geometric mean of 1 and the response of a circuit that is blocked at the balloon. A
    circuit that is blocked nearer to the board responds more.
    """
    free = capacity_mm3_per_kpa(pressure_kpa, balloon, circuit)
    return math.sqrt(free / tubes_capacity_mm3_per_kpa(pressure_kpa, circuit))


def _ratio(response: float, expected: float) -> float:
    return response / expected if expected > 0 else math.nan


def judge(inlet_ratio: float, vent_ratio: float, allowed: tuple[float, float]) -> Verdict:
    """Return the verdict on two responses, each divided by its expected value.

    A contact that begins or ends during the test changes one response, or both in opposite directions.
    Therefore, only two large responses show a blocked tube. NaN is inconclusive.
    """
    smallest, largest = allowed
    if smallest <= inlet_ratio <= largest and smallest <= vent_ratio <= largest:
        return Verdict.PASSED
    return Verdict.OCCLUDED if inlet_ratio > largest and vent_ratio > largest else Verdict.INCONCLUSIVE


@dataclass(slots=True)
class PulseMeter:
    """Meter of the pressure before, between and after the two pulses."""

    _testing: bool = False
    _before_kpa: float = math.nan
    _between_kpa: float = math.nan
    _now_kpa: float = math.nan  # average of the readings
    _inlet_s: float = 0.0  # opening time of the inlet
    _vent_s: float = 0.0  # opening time of the vent

    def step(self, message: Sample, reading_kpa: float, dt_s: float) -> PulseResponse | None:
        """Process one sample; return the response at the first sample after a test, otherwise None.

        An invalid reading is NaN.
        """
        response = None
        if message.state == BoardState.TESTING:
            self._add(message.valves, dt_s)
        elif self._testing:
            self._testing = False
            response = self._response() if message.state == BoardState.HOLDING else None
        if math.isfinite(self._now_kpa):
            self._now_kpa += (reading_kpa - self._now_kpa) * min(dt_s / AVERAGE_S, 1.0)
        else:
            self._now_kpa = reading_kpa
        return response

    def _add(self, valves: int, dt_s: float) -> None:
        if not self._testing:
            self._testing, self._before_kpa = True, self._now_kpa
            self._inlet_s = self._vent_s = 0.0
        if valves == _FILL:
            self._inlet_s += dt_s
        elif valves == _SAFE:
            if not self._vent_s:
                self._between_kpa = self._now_kpa
            self._vent_s += dt_s

    def _response(self) -> PulseResponse:
        """Return the response. It is NaN if a pulse is missing, or if its sample was lost."""
        if not (self._inlet_s and self._vent_s):
            return PulseResponse(math.nan, math.nan)
        rise_kpa, fall_kpa = self._between_kpa - self._before_kpa, self._between_kpa - self._now_kpa
        return PulseResponse(rise_kpa / self._inlet_s, fall_kpa / self._vent_s)


@dataclass(slots=True)
class ProofTest:
    """Evaluation of the proof tests at one setpoint."""

    #: Smaller one of the two responses of the last test, relative to the expected response.
    ratio: float = math.nan
    _setpoint_pa: int = 0
    _reference: PulseResponse | None = None  # response of the first test that passed at this setpoint
    _meter: PulseMeter = field(default_factory=PulseMeter)

    def step(self, message: Sample, reading_kpa: float, dt_s: float) -> PulseResponse | None:
        """Process one sample; return the response at the first sample after a test, otherwise None.

        An invalid reading is NaN.
        """
        if message.setpoint_pa != self._setpoint_pa:
            self._setpoint_pa, self._reference = message.setpoint_pa, None
        return self._meter.step(message, reading_kpa, dt_s)

    def judge(self, response: PulseResponse, balloon: Balloon, circuit: Circuit) -> Verdict:
        """Return the verdict on the response of a test.

        The first response at a setpoint is compared with the commissioned circuit. If it passes, it is the
        reference for the tests that follow.
        """
        pressure_kpa = self._setpoint_pa / 1e3
        expected = self._reference or commissioned_response(pressure_kpa, balloon, circuit)
        smallest = MIN_RATIO if self._reference else MIN_FIRST_RATIO
        inlet = _ratio(response.inlet_kpa_per_s, expected.inlet_kpa_per_s)
        vent = _ratio(response.vent_kpa_per_s, expected.vent_kpa_per_s)
        self.ratio = min(inlet, vent)
        verdict = judge(inlet, vent, (smallest, largest_ratio(pressure_kpa, balloon, circuit)))
        if verdict is Verdict.PASSED and self._reference is None:
            self._reference = response
        return verdict
