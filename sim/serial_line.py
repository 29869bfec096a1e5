"""The serial line between board and port, in both directions: noise, a pulled plug, another device."""

from __future__ import annotations

from dataclasses import dataclass, field

from sim.line_noise import Noise, NoisyLine

#: What a satellite receiver says: the device that most often takes a port's name.
OTHER_DEVICE = b"$GPGGA,120000,,,,,0,00,,,M,,M,,*66\r\n"
OTHER_EVERY_S = 0.2
#: Printed by a boot loader, and the second half of a frame that was under way.
BANNER = b"\r\nboot 4.4 ok\r\n" + bytes.fromhex("a55a33014200 00ff80138802040000")


@dataclass(slots=True)
class SerialLine:
    """Bytes on their way between board and host. As made it is clean, plugged in, and the board's own."""

    noise: Noise = field(default_factory=Noise)
    pulled: bool = False  #: nothing passes, and the port is gone
    other_device: bool = False  #: something else than the board sits at the port
    _to_host: NoisyLine = field(init=False)
    _to_board: NoisyLine = field(init=False)
    _other_said_s: float = 0.0
    _before: bytes = b""

    def __post_init__(self) -> None:
        self._to_host, self._to_board = NoisyLine(self.noise, 1), NoisyLine(self.noise, 2)

    def print_banner(self) -> None:
        """Let a boot loader say its name, and half a frame, before what the board sends next."""
        self._before += BANNER

    def to_host(self, sent: bytes, now_s: float) -> bytes:
        """What the host receives now of what the board sends now."""
        if self.other_device:
            sent = self._other(now_s)
        elif self._before and sent:
            sent, self._before = self._before + sent, b""
        return self._carry(self._to_host, sent, now_s)

    def to_board(self, sent: bytes, now_s: float) -> bytes:
        """What the board receives now of what the host sends now."""
        return self._carry(self._to_board, b"" if self.other_device else sent, now_s)

    def _carry(self, line: NoisyLine, sent: bytes, now_s: float) -> bytes:
        line.send(sent, now_s)
        arrived = line.due(now_s)
        return b"" if self.pulled else arrived

    def _other(self, now_s: float) -> bytes:
        if now_s < self._other_said_s + OTHER_EVERY_S:
            return b""
        self._other_said_s = now_s
        return OTHER_DEVICE
