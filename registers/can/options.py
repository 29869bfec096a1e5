"""How a node is set up, and the bus load that it can cause."""

from __future__ import annotations

from dataclasses import dataclass

from registers.can.frames import DEFAULT_NODE_ID, FORCE, FRAMES, Frame
from registers.can.wire import longest_bits

RIG_RATE_HZ = 500
ALARMS_PER_S = 50  #: Force frames sent early, at most: of a force that flickers about its limit
HIGHEST_LOAD = 0.6


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """Identity and rates of a node.

    500 kbit/s reaches 100 m of cable (CiA 301), is what most controllers come with, and leaves four fifths
    of the bus free at the highest Force rate.

    Raises ValueError: a value out of its span, or more bus load than 60 %.
    """

    node_id: int = DEFAULT_NODE_ID
    force_rate_hz: int = 100
    bit_rate: int = 500_000

    def __post_init__(self) -> None:
        if not 1 <= self.node_id <= 127:
            raise ValueError(f"CAN node id {self.node_id}: must be 1 to 127")
        if not 1 <= self.force_rate_hz <= RIG_RATE_HZ:
            raise ValueError(f"{self.force_rate_hz} Force frames per second: must be 1 to {RIG_RATE_HZ}")
        load = bus_load(self)
        if not load <= HIGHEST_LOAD:
            raise ValueError(
                f"{self.force_rate_hz} Force frames per second could load a CAN bus of {self.bit_rate} bit/s "
                f"by {load:.0%}; at most {HIGHEST_LOAD:.0%} is allowed: lower the rate or raise the bit rate"
            )

    @property
    def most_force_hz(self) -> int:
        """Force frames per second at most, those that an alarm sends early with them."""
        return min(self.force_rate_hz + ALARMS_PER_S, RIG_RATE_HZ)


def bus_load(options: Options) -> float:
    """Share of the bus that the node's frames take at worst: fully stuffed, each at its highest rate."""

    def rate_hz(frame: Frame) -> float:
        if frame is FORCE:
            return options.most_force_hz
        return frame.most_per_s

    return sum(rate_hz(frame) * longest_bits(frame.length) for frame in FRAMES) / options.bit_rate
