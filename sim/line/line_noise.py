"""Simulation of a bad line: disturbed, lost, additional and delayed bytes.

The module uses a seeded random generator. It reads no clock: the caller passes the time.
"""

from __future__ import annotations

import math
import random
from collections import deque
from dataclasses import dataclass, field

from pneuforce.errors import ConfigurationError

BURST_BITS = 16  #: length of the longest burst that the CRC of the frames always detects


#: Disturbances without a largest value. The others are fractions, or switches.
_UNLIMITED = ("delay_s", "max_chunk_bytes")


@dataclass(slots=True, kw_only=True)
class LineNoise:
    """Disturbances of a line, all absent by default. They may be changed during a transmission.

    Raises ConfigurationError for a value that is negative or no number, and for a fraction above 1.
    """

    flipped_bits: float = 0.0  #: fraction of bits that arrive inverted
    bursts: float = 0.0  #: fraction of bytes at which a burst of up to 16 disturbed bits starts
    dropped: float = 0.0  #: fraction of bytes that are lost
    doubled: float = 0.0  #: fraction of bytes that arrive twice
    inserted: float = 0.0  #: fraction of bytes that are followed by a random byte
    delay_s: float = 0.0  #: delay between sending and arrival
    max_chunk_bytes: int = 0  #: largest number of bytes that arrive together, 0 for no limit
    stalled: bool = False  #: bytes arrive only after the end of the stall
    cut: bool = False  #: bytes that are sent or in transit are lost

    def __setattr__(self, name: str, value: float) -> None:
        high = math.inf if name in _UNLIMITED else 1.0
        is_number = isinstance(value, int) or (isinstance(value, float) and name != "max_chunk_bytes")
        if not (is_number and 0.0 <= value <= high):
            allowed = f"0 to {high:g}" if high < math.inf else "0 or more"
            raise ConfigurationError(f"{name} = {value!r} is invalid: it must be {allowed}")
        object.__setattr__(self, name, value)  # super() does not work in a class with slots

    @property
    def changes_bytes(self) -> bool:
        """Return True if bytes may be changed, lost or added."""
        return any((self.flipped_bits, self.bursts, self.dropped, self.doubled, self.inserted))


@dataclass(slots=True)
class NoisyLine:
    """One direction of a line with noise."""

    noise: LineNoise
    seed: int = 1
    _in_transit: deque[tuple[float, bytes]] = field(default_factory=deque)  # (time of arrival [s], bytes)
    _burst: int = 0  # mask of the disturbed bits in the next three bytes
    _random: random.Random = field(init=False)

    def __post_init__(self) -> None:
        self._random = random.Random(self.seed)

    def send(self, data: bytes, now_s: float) -> None:
        """Send bytes over the line."""
        if data and not self.noise.cut:
            data = self._disturb(data) if self.noise.changes_bytes else data
            self._in_transit.append((now_s + self.noise.delay_s, data))

    def receive(self, now_s: float) -> bytes:
        """Return the bytes that arrive at `now_s`, in the order in which they were sent."""
        if not self._in_transit:
            return b""
        if self.noise.cut:
            self._in_transit.clear()
        received = bytearray()
        while self._arrives(now_s) and (room := self._room(len(received))):
            arrival_s, data = self._in_transit.popleft()
            received += data[:room]
            if data[room:]:
                self._in_transit.appendleft((arrival_s, data[room:]))
        return bytes(received)

    @property
    def in_transit(self) -> bool:
        """Return True if some of the sent bytes have not arrived yet."""
        return bool(self._in_transit)

    def _arrives(self, now_s: float) -> bool:
        return bool(self._in_transit) and self._in_transit[0][0] <= now_s and not self.noise.stalled

    def _room(self, received_bytes: int) -> int:
        """Return the number of bytes that may still arrive in this call."""
        limit = self.noise.max_chunk_bytes
        return limit - received_bytes if limit else len(self._in_transit[0][1])

    def _disturb(self, data: bytes) -> bytes:
        return b"".join(self._disturb_byte(byte) for byte in data)

    def _disturb_byte(self, byte: int) -> bytes:
        """Return the bytes that arrive for one sent byte: no byte, the byte, or more bytes."""
        noise, random_share = self.noise, self._random.random
        if random_share() < noise.dropped:
            return b""
        if random_share() < noise.bursts:
            self._burst = self._burst_mask()
        byte ^= self._burst >> 16
        self._burst = self._burst << 8 & 0xFFFFFF
        if noise.flipped_bits:
            byte ^= sum((random_share() < noise.flipped_bits) << bit for bit in range(8))
        copies = bytes((byte,)) * (1 + (random_share() < noise.doubled))
        return copies + self._random.randbytes(random_share() < noise.inserted)

    def _burst_mask(self) -> int:
        """Return a 24-bit mask with a burst of 16 random bits. A burst starts with a 1 in the first byte."""
        bits = 1 << BURST_BITS - 1 | self._random.getrandbits(BURST_BITS - 1)
        return bits << self._random.randint(1, 8)
