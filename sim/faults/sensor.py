"""Faults of the pressure sensor and of its supply."""

from __future__ import annotations

from pneuforce.protocol.frames import MAX_ADC_SUM, Fault
from pneuforce.sim.faults.kind import FaultArgument, FaultKind, FromArgument

OUT_OF_RANGE = "The board trips within 100 ms if the reading is below 1 % or above 98 % of full scale."
SUPPLY = "The board trips if the supply is outside 4.75 to 5.25 V."

SENSOR = (
    FaultKind(
        "sensor_open",
        "A wire of the sensor is broken: the ADC reads full scale.",
        OUT_OF_RANGE,
        {"rig.sensor.stuck_at": MAX_ADC_SUM},
        board_fault=Fault.SENSOR,
    ),
    FaultKind(
        "sensor_short",
        "The output of the sensor is shorted to ground.",
        OUT_OF_RANGE,
        {"rig.sensor.stuck_at": 0},
        board_fault=Fault.SENSOR,
    ),
    FaultKind(
        "sensor_frozen",
        "The sensor repeats its last reading.",
        "The board trips if the reading is constant for 200 ms while an open valve must change the pressure. "
        "While the balloon is held, both valves are closed, so the instrument shows the last force as valid "
        "until the next proof test or vent.",
        {"rig.sensor.frozen": True},
        board_fault=Fault.SENSOR_FROZEN,
        phase="inflating",
    ),
    FaultKind(
        "sensor_drift",
        "The zero of the sensor has drifted.",
        "While the balloon is held, the drift looks like a change of the pressure. After a vent, command 1 "
        "repeats the zero adjustment.",
        {"rig.sensor.drift_kpa": FromArgument("kpa")},
        arguments=(FaultArgument("kpa", "kPa", 0.1, -5.0, 5.0),),
    ),
    FaultKind(
        "supply_low",
        "The 5 V supply of sensor and ADC is too low.",
        SUPPLY,
        {"rig.supply_mv": FromArgument("mv")},
        arguments=(FaultArgument("mv", "mV", 4600.0, 0.0, 4749.0, integer=True),),
        board_fault=Fault.SUPPLY_VOLTAGE,
    ),
    FaultKind(
        "supply_high",
        "The 5 V supply of sensor and ADC is too high.",
        SUPPLY,
        {"rig.supply_mv": FromArgument("mv")},
        arguments=(FaultArgument("mv", "mV", 5400.0, 5251.0, 6000.0, integer=True),),
        board_fault=Fault.SUPPLY_VOLTAGE,
    ),
)
