"""Faults of the balloon, and what its surroundings do to it."""

from __future__ import annotations

from instrument.rig.frames import Fault
from sim.faults.kind import Argument, FaultKind, Given

DRIFT = "A slow change of the pressure is drift, not contact."

BALLOON = (
    FaultKind(
        "leak",
        "The balloon or a joint leaks.",
        "The fourth top-up within 10 minutes trips.",
        {"rig.pneumatics.leak_kpa_per_s": Given("kpa_per_s")},
        arguments=(Argument("kpa_per_s", "kPa/s at 8 kPa", 0.05, 0.0, 5.0),),
        board=Fault.LEAK,
    ),
    FaultKind(
        "burst",
        "The balloon tears.",
        "A locked pressure that falls by half within 100 ms trips.",
        {"rig.pneumatics.burst": True},
        board=Fault.BURST,
    ),
    FaultKind(
        "balloon_warming",
        "The gas in the balloon is warmed by the tissue.",
        DRIFT,
        {"rig.pneumatics.balloon_warmth.target_k": Given("k")},
        arguments=(Argument("k", "K", 15.0, -20.0, 20.0),),
        shows="drift",
    ),
    FaultKind(
        "creep",
        "The latex gives way: the balloon goes on growing at the same pressure.",
        DRIFT,
        {"rig.pneumatics.creep.amplitude": Given("share")},
        arguments=(Argument("share", "of the volume, in the end", 0.05, 0.0, 1.0),),
        shows="drift",
    ),
    FaultKind(
        "ambient_drift",
        "The barometer moves.",
        DRIFT,
        {"rig.pneumatics.ambient.drift_kpa_per_s": Given("kpa_per_s")},
        arguments=(Argument("kpa_per_s", "kPa/s", -0.005, -1.0, 1.0),),
        shows="drift",
    ),
    FaultKind(
        "insufflation",
        "The body cavity is insufflated while the balloon is held.",
        "It reads as a press: insufflate while the balloon is vented, and write register 518.",
        {"rig.pneumatics.reference_kpa": Given("kpa")},
        arguments=(Argument("kpa", "kPa", 1.5, 0.0, 5.0),),
    ),
    FaultKind(
        "squeeze",
        "Somebody squeezes the balloon far too hard.",
        "A locked pressure above the contact limit trips.",
        does="rig.hand.press",
        undoes="rig.hand.release",
        arguments=(Argument("n", "N", 20.0, 0.0, 20.0),),
        board=Fault.OVERPRESSURE,
    ),
)
