"""Serial line between board and host, with its faults: noise, unplugged cable, other device at the port."""

from __future__ import annotations

from dataclasses import dataclass, field

from pneuforce.sim.line.line_noise import LineNoise, NoisyLine

#: NMEA sentence of a satellite receiver, the device that most often takes the name of the port.
OTHER_DEVICE = b"$GPGGA,120000,,,,,0,00,,,M,,M,,*66\r\n"
OTHER_DEVICE_INTERVAL_S = 0.2
#: Output of a boot loader, followed by the first 15 bytes of a frame.
BANNER = b"\r\nboot 4.4 ok\r\n" + bytes.fromhex("a55a33014200 00ff80138802040000")


@dataclass(slots=True)
class SerialLine:
    """Line between board and host. By default it is plugged in, free of noise, and connected to the board."""

    noise: LineNoise = field(default_factory=LineNoise)
    unplugged: bool = False  #: if True, no bytes are transferred, and the port does not exist
    other_device: bool = False  #: if True, another device is connected instead of the board
    _to_host: NoisyLine = field(init=False)
    _to_board: NoisyLine = field(init=False)
    _other_device_sent_s: float = 0.0
    _banner: bytes = b""

    def __post_init__(self) -> None:
        self._to_host, self._to_board = NoisyLine(self.noise, 1), NoisyLine(self.noise, 2)

    def print_banner(self) -> None:
        """Insert the banner of a boot loader and an incomplete frame before the next bytes of the board."""
        self._banner += BANNER

    def to_host(self, sent: bytes, now_s: float) -> bytes:
        """Send bytes of the board and return the bytes that the host receives now."""
        if self.other_device:
            sent = self._other_device_output(now_s)
        elif self._banner and sent:
            sent, self._banner = self._banner + sent, b""
        return self._transfer(self._to_host, sent, now_s)

    def to_board(self, sent: bytes, now_s: float) -> bytes:
        """Send bytes of the host and return the bytes that the board receives now."""
        return self._transfer(self._to_board, b"" if self.other_device else sent, now_s)

    def _transfer(self, line: NoisyLine, sent: bytes, now_s: float) -> bytes:
        line.send(sent, now_s)
        received = line.receive(now_s)
        return b"" if self.unplugged else received

    def _other_device_output(self, now_s: float) -> bytes:
        if now_s < self._other_device_sent_s + OTHER_DEVICE_INTERVAL_S:
            return b""
        self._other_device_sent_s = now_s
        return OTHER_DEVICE
