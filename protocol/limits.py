"""Transfer function of the sensor, and limits that the host process and the board both use."""

from __future__ import annotations

from pneuforce.protocol.frames import ADC_FULL_SCALE, MAX_ADC_SUM, OVERSAMPLING, BoardState

#: Transfer function of the sensor: V_out = V_s (0.018 P + 0.04), P in kPa (Freescale MPXV5050 data sheet).
SENSITIVITY_PER_KPA = 0.018
OFFSET = 0.04
#: Largest zero error that the data sheet allows [kPa]. A larger zero error means a defective sensor.
ZERO_SPAN_KPA = 1.3
#: ADC sums of a connected sensor, 0.05–4.9 V at 5 V. Other sums mean that the sensor is open or short.
VALID_ADC_SUM = (0.01 * MAX_ADC_SUM, 0.98 * MAX_ADC_SUM)
SUPPLY_MV = (4750, 5250)

SETPOINT_PA = (2_000, 12_000)
HARD_LIMIT_KPA = 25.0
#: Time without a command after which the board closes the inlet.
HOST_SILENCE_S = 0.25
#: The rig counts as vented if the gauge pressure stays within the limit `VENTED_KPA` for the time `VENTED_S`.
VENTED_KPA = 0.3
VENTED_S = 0.5

#: Rate at which the pressure at the sensor rises while the inlet of the commissioned circuit is open.
FILL_KPA_PER_S = 5.0
#: Time in which the open vent of the commissioned circuit halves a pressure of `HALVING_FROM_KPA`. For
#: another pressure p, this time is multiplied by √(p / HALVING_FROM_KPA).
HALVING_TIME_S, HALVING_FROM_KPA = 0.55, 8.0
#: Rate at which the pressure falls at `HALVING_FROM_KPA` while the vent of the commissioned circuit is open.
VENT_KPA_PER_S = 8.0
#: The tube counts as occluded if the time of a pressure change, divided by the time of this change in the
#: commissioned circuit, is below this ratio. The change is faster because only a part of the gas flows.
OCCLUDED_TIME_RATIO = 0.6

#: States in which the balloon is inflated or is being inflated.
PRESSURISED = frozenset({BoardState.INFLATING, BoardState.SETTLING, BoardState.HOLDING, BoardState.TESTING})
#: States in which the balloon is held at its setpoint.
HELD = frozenset({BoardState.HOLDING, BoardState.TESTING})


def nominal_pressure_kpa(adc_sum: int) -> float:
    """Return the gauge pressure [kPa] for an ADC sum, without zero correction.

    Half a count is added to each conversion because the converter truncates.
    """
    ratio = (adc_sum + 0.5 * OVERSAMPLING) / ADC_FULL_SCALE
    return (ratio - OFFSET) / SENSITIVITY_PER_KPA


def adc_sum_is_valid(adc_sum: int) -> bool:
    """Return True if the ADC sum is possible for a sensor that is neither open nor short."""
    return VALID_ADC_SUM[0] <= adc_sum <= VALID_ADC_SUM[1]
