"""Faults of supply, valves and tubes."""

from __future__ import annotations

from instrument.rig.frames import Fault
from sim.faults.kind import Argument, FaultKind, Given

NO_RISE = "With the inlet open, no rise of 0.2 kPa in 300 ms shuts it and trips."

GAS = (
    FaultKind(
        "no_supply",
        "The gas supply is shut.",
        NO_RISE,
        {"rig.pneumatics.supply.shut": True},
        board=Fault.NO_RISE,
        where="vented",
    ),
    FaultKind(
        "regulator_high",
        "The regulator lets too much pressure through: the balloon fills far too fast.",
        "A pressure that rises far faster than at commissioning trips; so does 0.5 kPa above the setpoint.",
        {"rig.pneumatics.supply.regulator_kpa": Given("kpa")},
        arguments=(Argument("kpa", "kPa", 400.0, 0.0, 1000.0),),
        board=Fault.OCCLUSION,
        where="vented",
    ),
    FaultKind(
        "inlet_open",
        "The inlet valve is stuck open: gas keeps coming in.",
        "A locked pressure that rises looks like a press until it passes the pressure limit, which trips.",
        {"rig.pneumatics.inlet.stuck": True},
        board=Fault.OVERPRESSURE,
    ),
    FaultKind(
        "inlet_shut",
        "The inlet valve is stuck shut.",
        NO_RISE,
        {"rig.pneumatics.inlet.stuck": False},
        board=Fault.NO_RISE,
        where="vented",
    ),
    FaultKind(
        "vent_shut",
        "The vent valve is stuck shut: the balloon cannot be emptied.",
        "A pressure that does not fall though the vent is open trips.",
        {"rig.pneumatics.vent.stuck": False},
        board=Fault.VENT_SHUT,
        where="venting",
    ),
    FaultKind(
        "vent_open",
        "The vent valve is stuck open: the balloon empties.",
        "A locked pressure that falls by half within 100 ms trips: it reads as a burst.",
        {"rig.pneumatics.vent.stuck": True},
        board=Fault.BURST,
    ),
    FaultKind(
        "occluded",
        "The tube to the balloon is kinked: the balloon keeps its gas, and the sensor sees the tubes only.",
        "A pressure that falls far faster than at commissioning trips: the balloon may be inflated.",
        {"rig.pneumatics.occluded": True},
        board=Fault.OCCLUSION,
        where="venting",
    ),
    FaultKind(
        "circuit_warming",
        "The gas in the circuit is warmed.",
        "A slow rise of the pressure is drift, not contact.",
        {"rig.pneumatics.circuit_warmth.target_k": Given("k")},
        arguments=(Argument("k", "K", 2.0, -20.0, 20.0),),
        shows="drift",
    ),
)
