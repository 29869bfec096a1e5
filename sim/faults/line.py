"""Faults of the serial line between board and host."""

from __future__ import annotations

from pneuforce.sim.faults.kind import FaultArgument, FaultKind, FromArgument

COUNTED = "Damaged frames are rejected. Each disturbance causes the loss of at most one more frame."
LOST = (
    "After 250 ms the host reports the loss and trips, and the board closes the inlet. "
    "After 2 s the board vents."
)
RATE = ("of all bytes", 0.001, 0.0, 1.0)

LINE = (
    FaultKind(
        "flipped_bits",
        "Single bits arrive inverted.",
        COUNTED,
        {"line.noise.flipped_bits": FromArgument("share")},
        arguments=(FaultArgument("share", "of all bits", 0.0003, 0.0, 1.0),),
        effect="losses",
    ),
    FaultKind(
        "bursts",
        "Up to 16 consecutive bits are disturbed.",
        COUNTED,
        {"line.noise.bursts": FromArgument("share")},
        arguments=(FaultArgument("share", *RATE),),
        effect="losses",
    ),
    FaultKind(
        "dropped_bytes",
        "Bytes are lost.",
        COUNTED,
        {"line.noise.dropped": FromArgument("share")},
        arguments=(FaultArgument("share", *RATE),),
        effect="losses",
    ),
    FaultKind(
        "doubled_bytes",
        "Bytes arrive twice.",
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
        "Nothing trips if a command arrives every 250 ms.",
        {"line.noise.delay_s": FromArgument("s")},
        arguments=(FaultArgument("s", "s", 0.05, 0.0, 10.0),),
    ),
    FaultKind(
        "stall",
        "No bytes arrive until the fault is removed. Then all bytes arrive.",
        LOST,
        {"line.noise.stalled": True},
        effect="link_lost",
    ),
    FaultKind(
        "line_cut",
        "No bytes arrive, and the bytes are lost. The port remains.",
        LOST,
        {"line.noise.cut": True},
        effect="link_lost",
    ),
    FaultKind(
        "cable_pulled",
        "The cable is unplugged: the port and its symlink disappear. The next port has another name.",
        LOST,
        {"line.unplugged": True},
        effect="link_lost",
    ),
    FaultKind(
        "other_device",
        "Another device, a satellite receiver, has taken the name of the port and sends its own data.",
        "Its bytes are skipped. A port without a board is rejected with an error message.",
        {"line.other_device": True},
        effect="link_lost",
    ),
    FaultKind(
        "banner",
        "A boot loader prints its name, and half a frame follows.",
        "Bytes that are not part of a frame are skipped and counted.",
        call="line.print_banner",
        effect="losses",
    ),
)
