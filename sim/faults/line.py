"""Faults of the serial line between board and host."""

from __future__ import annotations

from pneuforce.sim.faults.kind import FaultArgument, FaultKind, FromArgument

COUNTED = (
    "The receiver rejects damaged frames. In addition to the damaged frames, each disturbance destroys at "
    "most one frame."
)
LOST = (
    "After 250 ms, the host reports the loss of the link and trips the rig, and the board closes the "
    "inlet. After 2 s, the board vents the balloon."
)
RATE = ("of all bytes", 0.001, 0.0, 1.0)

LINE = (
    FaultKind(
        "flipped_bits",
        "Some bits arrive inverted.",
        COUNTED,
        {"line.noise.flipped_bits": FromArgument("share")},
        arguments=(FaultArgument("share", "of all bits", 0.0003, 0.0, 1.0),),
        effect="losses",
    ),
    FaultKind(
        "bursts",
        "Bursts disturb up to 16 consecutive bits.",
        COUNTED,
        {"line.noise.bursts": FromArgument("share")},
        arguments=(FaultArgument("share", *RATE),),
        effect="losses",
    ),
    FaultKind(
        "dropped_bytes",
        "Some bytes are lost.",
        COUNTED,
        {"line.noise.dropped": FromArgument("share")},
        arguments=(FaultArgument("share", *RATE),),
        effect="losses",
    ),
    FaultKind(
        "doubled_bytes",
        "Some bytes arrive twice.",
        COUNTED,
        {"line.noise.doubled": FromArgument("share")},
        arguments=(FaultArgument("share", *RATE),),
        effect="losses",
    ),
    FaultKind(
        "inserted_bytes",
        "Additional random bytes arrive.",
        COUNTED,
        {"line.noise.inserted": FromArgument("share")},
        arguments=(FaultArgument("share", *RATE),),
        effect="losses",
    ),
    FaultKind(
        "delay",
        "All bytes are delayed in both directions.",
        "The rig does not trip if the pauses between commands stay below 250 ms.",
        {"line.noise.delay_s": FromArgument("s")},
        arguments=(FaultArgument("s", "s", 0.05, 0.0, 10.0),),
    ),
    FaultKind(
        "stall",
        "No bytes arrive until the fault is removed. Then all delayed bytes arrive.",
        LOST,
        {"line.noise.stalled": True},
        effect="link_lost",
    ),
    FaultKind(
        "line_cut",
        "All bytes are lost, but the port remains.",
        LOST,
        {"line.noise.cut": True},
        effect="link_lost",
    ),
    FaultKind(
        "cable_pulled",
        "The cable is unplugged: the port and its symlink disappear. When the cable is plugged in again, the "
        "port has another name.",
        "The host reports that the port has disappeared, and trips the rig at once. After 250 ms, the board "
        "closes the inlet. After 2 s, the board vents the balloon.",
        {"line.unplugged": True},
        effect="link_lost",
    ),
    FaultKind(
        "other_device",
        "A satellite receiver has taken the name of the port and sends its own data.",
        "The host skips these bytes. A port without a board is rejected with an error message.",
        {"line.other_device": True},
        effect="link_lost",
    ),
    FaultKind(
        "banner",
        "A boot loader sends its name, and then half a frame follows.",
        "The host skips and counts bytes that are not part of a frame.",
        call="line.print_banner",
        effect="losses",
    ),
)
