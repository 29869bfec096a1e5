"""Fake board: a thread at the far end of a pseudo-terminal, and a symbolic link in place of a cable."""

import contextlib
import os
import select
import threading
import time
import tty

from pneuforce.instrument.rig.firmware import CURRENT_VERSION
from pneuforce.protocol.firmware_images import IMAGES
from pneuforce.protocol.frames import (
    PROTOCOL_VERSION,
    BoardKind,
    BoardState,
    Command,
    FrameDecoder,
    Hello,
    Identify,
    Image,
    Mode,
    Sample,
    Valve,
    Vent,
    encode,
)
from tests.instrument.instrument_harness import adc_sum_of


class FakeBoard(threading.Thread):
    """Board that follows each command at once and sends 500 samples a second.

    `received` lists the messages from the host process with their times.
    """

    def __init__(self, uptime_ms=1000, version=PROTOCOL_VERSION, silence_ms=250, host_timeout_ms=2000):
        super().__init__(daemon=True)
        self._board_fd, self._port_fd = os.openpty()
        tty.setraw(self._port_fd)
        self.path = os.ttyname(self._port_fd)
        self.received = []
        self.state = BoardState.VENTED
        self.mute = False  #: True if the board sends no samples
        self.vent_blocked = False  #: True if a vent does not change the pressure
        self.uptime_ms, self.version = uptime_ms, version
        self.silence_ms, self.host_timeout_ms = silence_ms, host_timeout_ms
        self.ignores_host_timeout = False
        self.image_crc = IMAGES[CURRENT_VERSION]  #: None if the firmware reports no image
        self.noise = b""  #: bytes that the board sends every 2 ms
        self._identified = False
        self._started_s = time.monotonic()
        self._samples = self._command_echo = 0
        self._decoder = FrameDecoder.for_host_frames()
        self._ended = threading.Event()

    def run(self):
        due_s = time.monotonic()
        with contextlib.suppress(OSError):
            while not self._ended.is_set():
                due_s = max(due_s + 0.002, time.monotonic() - 0.02)
                while select.select([self._board_fd], [], [], max(0.0, due_s - time.monotonic()))[0]:
                    self._receive(os.read(self._board_fd, 4096))
                self._send_sample()

    def _receive(self, data):
        for frame in self._decoder.feed(data):
            message = frame.message
            self.received.append((time.monotonic(), message))
            if isinstance(message, Identify):
                self._identified = self.version == PROTOCOL_VERSION
                self._identify()
            elif isinstance(message, Vent):
                self.state = BoardState.VENTED
            elif isinstance(message, Command):
                self._command_echo = frame.sequence & 0xFF
                self.state = BoardState.HOLDING if message.mode == Mode.HOLD else BoardState.VENTED
                if not self.ignores_host_timeout:
                    self.host_timeout_ms = message.host_timeout_ms

    def _identify(self):
        if self.image_crc is not None:
            self._send(Image(self.image_crc))
        self._send(self._hello())

    def _hello(self):
        return Hello(
            BoardKind.EMULATED, CURRENT_VERSION, self._age_ms(), 7, self.silence_ms, self.host_timeout_ms
        )

    def _age_ms(self):
        return self.uptime_ms + round((time.monotonic() - self._started_s) * 1e3)

    def _send_sample(self):
        if self.noise:
            os.write(self._board_fd, self.noise)
        if self._identified and not self.mute:
            held = self.vent_blocked or self.state is BoardState.HOLDING
            pressure_kpa, valves, setpoint_pa = (8.0, Valve.VENT_CLOSED, 8000) if held else (0.0, 0, 0)
            adc_sum, time_us = adc_sum_of(pressure_kpa + 0.2), self._samples * 2000
            self._send(
                Sample(time_us, adc_sum, 5000, valves, self.state, 0, 0, self._command_echo, setpoint_pa)
            )

    def _send(self, message):
        os.write(self._board_fd, encode(message, self._samples, self.version))
        self._samples += isinstance(message, Sample)

    def restart(self):
        """Restart as after a brown-out: vent, send a new Hello, and wait for a new handshake."""
        self.state, self._identified, self._samples = BoardState.VENTED, False, 0
        self.uptime_ms, self._started_s = 0, time.monotonic()
        self._identify()

    def messages(self, kind):
        """Return the received messages of one kind, each with its time."""
        return [(t_s, message) for t_s, message in list(self.received) if isinstance(message, kind)]

    def end(self):
        self._ended.set()
        if self.is_alive():
            self.join(5.0)
        for descriptor in (self._board_fd, self._port_fd):
            with contextlib.suppress(OSError):
                os.close(descriptor)


class FakeCable:
    """Symbolic link in place of the port, and a list of all boards that were plugged in."""

    def __init__(self, path):
        self.path, self.boards = path, []

    def plug(self, **board):
        """Start a new board, link the port to it, and return it."""
        self.boards.append(FakeBoard(**board))
        self.path.unlink(missing_ok=True)
        self.path.symlink_to(self.boards[-1].path)
        self.boards[-1].start()
        return self.boards[-1]

    def unplug(self):
        self.path.unlink()
        self.boards[-1].end()
