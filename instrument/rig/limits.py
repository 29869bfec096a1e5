"""What host and board both promise: the sensor's law and the limits that each side keeps by itself."""

from __future__ import annotations

from instrument.rig.frames import ADC_FULL_SCALE, COUNTS_LIMIT, OVERSAMPLING, BoardState

#: V_out = V_s (0.018 P + 0.04), Freescale MPXV5050 data sheet, P in kPa.
SENSITIVITY_PER_KPA = 0.018
OFFSET = 0.04
#: What the data sheet allows the zero to be off [kPa]: a zero beyond it is a broken sensor.
ZERO_SPAN_KPA = 1.3
#: ADC sums of a living sensor: 0.05–4.9 V at 5 V; else it is open or short.
ALIVE_SUM = (0.01 * COUNTS_LIMIT, 0.98 * COUNTS_LIMIT)
SUPPLY_MV = (4750, 5250)

SETPOINT_PA = (2_000, 12_000)
HARD_LIMIT_KPA = 25.0
HOST_SILENCE_S = 0.25
#: Vented is below this pressure for this time.
VENTED_KPA = 0.3
VENTED_S = 0.5

#: The circuit as it was commissioned, by its sensor: how fast the open inlet raises the pressure, and in
#: which time the vent halves `HALVED_KPA`. From other pressures it takes √(p / HALVED_KPA) times as long.
FILL_KPA_PER_S = 5.0
HALVING_S, HALVED_KPA = 0.55, 8.0
#: Where it takes less than this share of the time, less gas moves than balloon and tubes hold.
OCCLUDED_SHARE = 0.6

#: States in which the balloon is filled, or on its way.
PRESSURISED = frozenset({BoardState.INFLATING, BoardState.SETTLING, BoardState.HOLDING})


def nominal_pressure_kpa(adc_sum: int) -> float:
    """Gauge pressure [kPa] of a sum of 16 conversions, before the zero. Half a count undoes truncation."""
    ratio = (adc_sum + 0.5 * OVERSAMPLING) / ADC_FULL_SCALE
    return (ratio - OFFSET) / SENSITIVITY_PER_KPA


def alive(adc_sum: int) -> bool:
    """Whether a sensor that reads this is neither open nor short."""
    return ALIVE_SUM[0] <= adc_sum <= ALIVE_SUM[1]
