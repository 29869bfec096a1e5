"""Options of a CAN node, and the bus load that they can cause."""

from __future__ import annotations

from dataclasses import dataclass

from pneuforce.registers.can.frames import DEFAULT_NODE_ID, FORCE, FRAMES, FrameDefinition
from pneuforce.registers.can.wire import worst_case_bits

SAMPLE_RATE_HZ = 500
#: Limit for the Force frames that are sent early because of an alarm. Without this limit, a force that varies
#: around its alarm limit would cause a flood of frames.
MAX_ALARM_FRAMES_PER_S = 50
MAX_BUS_LOAD = 0.6


@dataclass(frozen=True, slots=True, kw_only=True)
class CanOptions:
    """Node id, Force rate and bit rate of a node.

    The default bit rate of 500 kbit/s allows 100 m of cable (CiA 301) and is the default of most controllers.
    With this bit rate, four fifths of the bus stay free even at the highest Force rate.

    Raises ValueError if a value is outside its range, or if the bus load can exceed 60 %.
    """

    node_id: int = DEFAULT_NODE_ID
    force_rate_hz: int = 100
    bit_rate: int = 500_000

    def __post_init__(self) -> None:
        if not 1 <= self.node_id <= 127:
            raise ValueError(f"CAN node id {self.node_id} is invalid: it must be 1 to 127")
        if not 1 <= self.force_rate_hz <= SAMPLE_RATE_HZ:
            raise ValueError(
                f"{self.force_rate_hz} Force frames per second is invalid: it must be 1 to {SAMPLE_RATE_HZ}"
            )
        load = bus_load(self)
        if not load <= MAX_BUS_LOAD:
            raise ValueError(
                f"{self.force_rate_hz} Force frames per second can load a CAN bus of {self.bit_rate} bit/s "
                f"by {load:.0%}; at most {MAX_BUS_LOAD:.0%} is allowed: lower the rate or raise the bit rate"
            )

    @property
    def max_force_rate_hz(self) -> int:
        """Return the highest number of Force frames per second, including frames sent early at an alarm."""
        return min(self.force_rate_hz + MAX_ALARM_FRAMES_PER_S, SAMPLE_RATE_HZ)


def bus_load(options: CanOptions) -> float:
    """Return the worst-case bus load of the node's frames, 0 to 1.

    The calculation assumes the largest number of stuff bits and the highest rate of each frame.
    """

    def rate_hz(frame: FrameDefinition) -> float:
        if frame is FORCE:
            return options.max_force_rate_hz
        return frame.max_rate_hz

    return sum(rate_hz(frame) * worst_case_bits(frame.length) for frame in FRAMES) / options.bit_rate
