"""Faults of the serial line between board and host."""

from __future__ import annotations

from sim.faults.kind import Argument, FaultKind, Given

COUNTED = "No wrong frame is accepted, a disturbance costs one further frame at most, losses are counted."
LOST = "After 250 ms the host says so and trips, and the board shuts its inlet; 2 s later it vents."
RATE = ("of all bytes", 0.001, 0.0, 1.0)

LINE = (
    FaultKind(
        "flipped_bits",
        "Single bits arrive inverted.",
        COUNTED,
        {"line.noise.flipped_bits": Given("share")},
        arguments=(Argument("share", "of all bits", 0.0003, 0.0, 1.0),),
        shows="losses",
    ),
    FaultKind(
        "bursts",
        "Up to 16 bits in a row are disturbed.",
        COUNTED,
        {"line.noise.bursts": Given("share")},
        arguments=(Argument("share", *RATE),),
        shows="losses",
    ),
    FaultKind(
        "dropped_bytes",
        "Bytes do not arrive.",
        COUNTED,
        {"line.noise.dropped": Given("share")},
        arguments=(Argument("share", *RATE),),
        shows="losses",
    ),
    FaultKind(
        "doubled_bytes",
        "Bytes arrive twice.",
        COUNTED,
        {"line.noise.doubled": Given("share")},
        arguments=(Argument("share", *RATE),),
        shows="losses",
    ),
    FaultKind(
        "inserted_bytes",
        "Bytes arrive that nobody sent.",
        COUNTED,
        {"line.noise.inserted": Given("share")},
        arguments=(Argument("share", *RATE),),
        shows="losses",
    ),
    FaultKind(
        "delay",
        "Bytes are under way for a while, both ways.",
        "Nothing trips while commands come every 250 ms.",
        {"line.noise.delay_s": Given("s")},
        arguments=(Argument("s", "s", 0.05, 0.0, 10.0),),
    ),
    FaultKind(
        "stall",
        "Nothing arrives; all of it comes late once the fault is taken out.",
        LOST,
        {"line.noise.stalled": True},
        shows="link_lost",
    ),
    FaultKind(
        "line_cut",
        "Nothing arrives, and it is lost; the port stays.",
        LOST,
        {"line.noise.cut": True},
        shows="link_lost",
    ),
    FaultKind(
        "cable_pulled",
        "The cable is pulled: the port and its link vanish, and come back under another name.",
        LOST,
        {"line.pulled": True},
        shows="link_lost",
    ),
    FaultKind(
        "other_device",
        "Another device has taken the port's name: a satellite receiver talks.",
        "Its bytes are skipped; a port on which no board answers is refused in a sentence.",
        {"line.other_device": True},
        shows="link_lost",
    ),
    FaultKind(
        "banner",
        "A boot loader prints its name, and half a frame follows.",
        "What is no frame is skipped and counted.",
        does="line.print_banner",
        shows="losses",
    ),
)
