"""Faults of gas supply, valves and tubes."""

from __future__ import annotations

from pneuforce.protocol.frames import Fault
from pneuforce.sim.faults.kind import FaultArgument, FaultKind, FromArgument

NO_RISE = "The board trips if the open inlet raises the pressure by less than 0.2 kPa in 300 ms."

GAS = (
    FaultKind(
        "no_supply",
        "The gas supply is shut off.",
        NO_RISE,
        {"rig.pneumatics.supply.shut": True},
        board_fault=Fault.NO_RISE,
        phase="vented",
    ),
    FaultKind(
        "regulator_high",
        "The outlet pressure of the regulator is too high: the balloon fills much too fast.",
        "The board trips if the pressure rises much faster than at commissioning. The board "
        "also trips if the pressure exceeds the setpoint by 0.5 kPa.",
        {"rig.pneumatics.supply.regulator_kpa": FromArgument("kpa")},
        arguments=(FaultArgument("kpa", "kPa", 400.0, 0.0, 1000.0),),
        board_fault=Fault.OCCLUSION,
        phase="vented",
    ),
    FaultKind(
        "inlet_open",
        "The inlet valve is stuck open: gas flows in continuously.",
        "The rise of the pressure looks like a contact. The board trips when the pressure exceeds the "
        "contact limit.",
        {"rig.pneumatics.inlet.stuck": True},
        board_fault=Fault.OVERPRESSURE,
    ),
    FaultKind(
        "inlet_leak",
        "The shut inlet valve leaks: gas flows slowly into the held balloon.",
        "The instrument treats a slow rise of the pressure as drift. The uncertainty of the force grows with "
        "the rise, and above a limit there is no force.",
        {"rig.pneumatics.inlet_leak_kpa_per_s": FromArgument("kpa_per_s")},
        arguments=(FaultArgument("kpa_per_s", "kPa/s at 8 kPa", 0.02, 0.0, 5.0),),
        effect="drift",
    ),
    FaultKind(
        "inlet_shut",
        "The inlet valve is stuck shut.",
        NO_RISE,
        {"rig.pneumatics.inlet.stuck": False},
        board_fault=Fault.NO_RISE,
        phase="vented",
    ),
    FaultKind(
        "vent_shut",
        "The vent valve is stuck shut: the balloon cannot be emptied.",
        "The board trips if the pressure does not fall after the board has opened the vent.",
        {"rig.pneumatics.vent.stuck": False},
        board_fault=Fault.VENT_SHUT,
        phase="venting",
    ),
    FaultKind(
        "vent_open",
        "The vent valve is stuck open: the balloon empties.",
        "The board trips and reports a burst if the held pressure falls by half within 100 ms.",
        {"rig.pneumatics.vent.stuck": True},
        board_fault=Fault.BURST,
    ),
    FaultKind(
        "occluded",
        "The tube to the balloon is kinked: the balloon keeps its gas, and the sensor measures only the "
        "pressure in the tubes.",
        "The board trips if the pressure falls much faster than at commissioning, also if the vent begins in "
        "a contact. While the balloon is held, the proof test of the host trips with the same fault. The "
        "balloon may still be inflated.",
        {"rig.pneumatics.occluded": True},
        board_fault=Fault.OCCLUSION,
        phase="venting",
    ),
    FaultKind(
        "circuit_warming",
        "The gas in the circuit warms up.",
        "The instrument treats a slow rise of the pressure as drift.",
        {"rig.pneumatics.circuit_temperature.target_k": FromArgument("k")},
        arguments=(FaultArgument("k", "K", 2.0, -20.0, 20.0),),
        effect="drift",
    ),
)
