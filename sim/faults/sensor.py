"""Faults of the pressure sensor and of its supply."""

from __future__ import annotations

from instrument.rig.frames import COUNTS_LIMIT, Fault
from sim.faults.kind import Argument, FaultKind, Given

DEAD = "A reading below 1 % or above 98 % of full scale trips within 100 ms."
SPAN = "A supply outside 4.75 to 5.25 V trips."

SENSOR = (
    FaultKind(
        "sensor_open",
        "The sensor's wire is broken: the ADC reads full scale.",
        DEAD,
        {"rig.sensor.stuck_at": COUNTS_LIMIT},
        board=Fault.SENSOR,
    ),
    FaultKind(
        "sensor_short",
        "The sensor's output is shorted to ground.",
        DEAD,
        {"rig.sensor.stuck_at": 0},
        board=Fault.SENSOR,
    ),
    FaultKind(
        "sensor_frozen",
        "The sensor repeats its last reading for ever.",
        "A reading that stands still for 200 ms though a valve is open and the pressure must move trips.",
        {"rig.sensor.frozen": True},
        board=Fault.STUCK,
        where="inflating",
    ),
    FaultKind(
        "sensor_drift",
        "The sensor's zero has moved.",
        "Not told from a pressure while the balloon is held; a new zero is taken when it is vented.",
        {"rig.sensor.drift_kpa": Given("kpa")},
        arguments=(Argument("kpa", "kPa", 0.1, -5.0, 5.0),),
    ),
    FaultKind(
        "supply_low",
        "The 5 V supply of sensor and ADC sags.",
        SPAN,
        {"rig.supply_mv": Given("mv")},
        arguments=(Argument("mv", "mV", 4600.0, 0.0, 4749.0, whole=True),),
        board=Fault.SUPPLY_VOLTAGE,
    ),
    FaultKind(
        "supply_high",
        "The 5 V supply of sensor and ADC is too high.",
        SPAN,
        {"rig.supply_mv": Given("mv")},
        arguments=(Argument("mv", "mV", 5400.0, 5251.0, 6000.0, whole=True),),
        board=Fault.SUPPLY_VOLTAGE,
    ),
)
