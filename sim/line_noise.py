"""Line noise: what a bad line does to bytes on their way. Pure and seeded; time is an argument."""

from __future__ import annotations

import random
from collections import deque
from dataclasses import dataclass, field

BURST_BITS = 16  #: the longest burst that the frames' CRC is sure to detect


@dataclass(slots=True, kw_only=True)
class Noise:
    """How bad a line is. It may be changed while bytes are on their way; as made, the line is clean."""

    flipped_bits: float = 0.0  #: share of bits that arrive inverted
    bursts: float = 0.0  #: share of bytes at which up to 16 bits in a row are disturbed
    dropped: float = 0.0  #: share of bytes that do not arrive
    doubled: float = 0.0  #: share of bytes that arrive twice
    inserted: float = 0.0  #: share of bytes that a byte of nobody's follows
    delay_s: float = 0.0  #: how long a byte is under way
    most_bytes: int = 0  #: that arrive at once, 0 for any number: splits what was sent in one piece
    stalled: bool = False  #: what is under way waits, and arrives once this is over
    cut: bool = False  #: what is sent or under way is lost

    @property
    def disturbs(self) -> bool:
        """Whether bytes may change."""
        return any((self.flipped_bits, self.bursts, self.dropped, self.doubled, self.inserted))


@dataclass(slots=True)
class NoisyLine:
    """One direction of a line: bytes go in at one end and arrive, later and perhaps other, at the far end."""

    noise: Noise
    seed: int = 1
    _under_way: deque[tuple[float, bytes]] = field(default_factory=deque)  # (due [s], bytes)
    _burst: int = 0  # disturbed bits of the next three bytes
    _random: random.Random = field(init=False)

    def __post_init__(self) -> None:
        self._random = random.Random(self.seed)

    def send(self, data: bytes, now_s: float) -> None:
        """Put bytes on the line."""
        if data and not self.noise.cut:
            data = self._disturbed(data) if self.noise.disturbs else data
            self._under_way.append((now_s + self.noise.delay_s, data))

    def due(self, now_s: float) -> bytes:
        """What arrives now, in the order in which it was sent."""
        if not self._under_way:
            return b""
        if self.noise.cut:
            self._under_way.clear()
        arrived = bytearray()
        while self._arrives(now_s) and (room := self._room(len(arrived))):
            due_s, data = self._under_way.popleft()
            arrived += data[:room]
            if data[room:]:
                self._under_way.appendleft((due_s, data[room:]))
        return bytes(arrived)

    @property
    def under_way(self) -> bool:
        """Whether bytes are still to arrive."""
        return bool(self._under_way)

    def _arrives(self, now_s: float) -> bool:
        return bool(self._under_way) and self._under_way[0][0] <= now_s and not self.noise.stalled

    def _room(self, arrived_bytes: int) -> int:
        """How many more bytes may arrive at once."""
        most = self.noise.most_bytes
        return most - arrived_bytes if most else len(self._under_way[0][1])

    def _disturbed(self, data: bytes) -> bytes:
        return b"".join(self._one(byte) for byte in data)

    def _one(self, byte: int) -> bytes:
        """What becomes of one byte."""
        noise, chance = self.noise, self._random.random
        if chance() < noise.dropped:
            return b""
        if chance() < noise.bursts:
            self._burst = self._burst_mask()
        byte ^= self._burst >> 16
        self._burst = self._burst << 8 & 0xFFFFFF
        if noise.flipped_bits:
            byte ^= sum((chance() < noise.flipped_bits) << bit for bit in range(8))
        arrives = bytes((byte,)) * (1 + (chance() < noise.doubled))
        return arrives + self._random.randbytes(chance() < noise.inserted)

    def _burst_mask(self) -> int:
        """16 random bits, the first of them disturbed, that begin anywhere in the first of three bytes."""
        bits = 1 << BURST_BITS - 1 | self._random.getrandbits(BURST_BITS - 1)
        return bits << self._random.randint(1, 8)
