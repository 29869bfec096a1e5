"""Faults of the balloon and of its surroundings."""

from __future__ import annotations

from pneuforce.protocol.frames import Fault
from pneuforce.sim.faults.kind import FaultArgument, FaultKind, FromArgument

DRIFT = "The instrument treats a slow change of the pressure as drift."

BALLOON = (
    FaultKind(
        "leak",
        "The balloon or a joint leaks.",
        "The board trips if a fourth top-up is necessary within 10 minutes.",
        {"rig.pneumatics.leak_kpa_per_s": FromArgument("kpa_per_s")},
        arguments=(FaultArgument("kpa_per_s", "kPa/s at 8 kPa", 0.05, 0.0, 5.0),),
        board_fault=Fault.LEAK,
    ),
    FaultKind(
        "burst",
        "The balloon tears.",
        "The board trips if the held pressure falls by half within 100 ms.",
        {"rig.pneumatics.burst": True},
        board_fault=Fault.BURST,
    ),
    FaultKind(
        "balloon_warming",
        "The tissue warms the gas in the balloon.",
        DRIFT,
        {"rig.pneumatics.balloon_temperature.target_k": FromArgument("k")},
        arguments=(FaultArgument("k", "K", 15.0, -20.0, 20.0),),
        effect="drift",
    ),
    FaultKind(
        "creep",
        "The latex creeps: the balloon grows at constant pressure.",
        DRIFT,
        {"rig.pneumatics.creep.amplitude": FromArgument("share")},
        arguments=(FaultArgument("share", "of the volume, after a long time", 0.05, 0.0, 1.0),),
        effect="drift",
    ),
    FaultKind(
        "ambient_drift",
        "The ambient pressure changes slowly.",
        DRIFT,
        {"rig.pneumatics.ambient.drift_kpa_per_s": FromArgument("kpa_per_s")},
        arguments=(FaultArgument("kpa_per_s", "kPa/s", -0.005, -1.0, 1.0),),
        effect="drift",
    ),
    FaultKind(
        "insufflation",
        "The body cavity is insufflated while the balloon is held.",
        "The change of the pressure looks like a contact. Therefore, insufflate while the balloon is vented, "
        "and write the pressure in the cavity to register 518. If the configuration sets "
        "reference_timeout_s, write this register periodically.",
        {"rig.pneumatics.reference_kpa": FromArgument("kpa")},
        arguments=(FaultArgument("kpa", "kPa", 1.5, 0.0, 5.0),),
    ),
    FaultKind(
        "squeeze",
        "The balloon is squeezed much too hard.",
        "The board trips if the held pressure exceeds the contact limit.",
        call="rig.hand.press",
        undo_call="rig.hand.release",
        arguments=(FaultArgument("n", "N", 20.0, 0.0, 20.0),),
        board_fault=Fault.OVERPRESSURE,
    ),
)
