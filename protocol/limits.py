"""Sensor law and limits that the host process and the board both enforce."""

from __future__ import annotations

from pneuforce.protocol.frames import ADC_FULL_SCALE, MAX_ADC_SUM, OVERSAMPLING, BoardState

#: Transfer function of the sensor: V_out = V_s (0.018 P + 0.04), P in kPa (Freescale MPXV5050 data sheet).
SENSITIVITY_PER_KPA = 0.018
OFFSET = 0.04
#: Largest zero error that the data sheet allows [kPa]. A larger zero means a broken sensor.
ZERO_SPAN_KPA = 1.3
#: ADC sums of a connected sensor, 0.05–4.9 V at 5 V. Other sums mean that the sensor is open or short.
VALID_ADC_SUM = (0.01 * MAX_ADC_SUM, 0.98 * MAX_ADC_SUM)
SUPPLY_MV = (4750, 5250)

SETPOINT_PA = (2_000, 12_000)
HARD_LIMIT_KPA = 25.0
#: Time without a command after which the board closes the inlet.
HOST_SILENCE_S = 0.25
#: The rig counts as vented if the pressure stays below this limit [kPa] for this time [s].
VENTED_KPA = 0.3
VENTED_S = 0.5

#: Rate at which the open inlet raises the pressure at the sensor, in the circuit as commissioned.
FILL_KPA_PER_S = 5.0
#: Time in which the open vent halves a pressure of `HALVING_FROM_KPA`, in the circuit as commissioned.
#: Another pressure p is halved in √(p / HALVING_FROM_KPA) times this time.
HALVING_TIME_S, HALVING_FROM_KPA = 0.55, 8.0
#: The tube counts as occluded if a pressure change takes less than this ratio of the commissioned time. The
#: change is faster because only part of the gas in balloon and tubes moves.
OCCLUDED_TIME_RATIO = 0.6

#: States in which the balloon is inflated or is being inflated.
PRESSURISED = frozenset({BoardState.INFLATING, BoardState.SETTLING, BoardState.HOLDING})


def nominal_pressure_kpa(adc_sum: int) -> float:
    """Return the gauge pressure [kPa] of a sum of 16 conversions, without zero correction.

    Half a count is added to each conversion because the converter truncates.
    """
    ratio = (adc_sum + 0.5 * OVERSAMPLING) / ADC_FULL_SCALE
    return (ratio - OFFSET) / SENSITIVITY_PER_KPA


def adc_sum_is_valid(adc_sum: int) -> bool:
    """Return True if the ADC sum is possible for a sensor that is neither open nor short."""
    return VALID_ADC_SUM[0] <= adc_sum <= VALID_ADC_SUM[1]
