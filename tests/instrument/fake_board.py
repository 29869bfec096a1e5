"""A small board in a thread behind a pty, and the symlink that stands for its cable."""

import contextlib
import os
import select
import threading
import time
import tty

from instrument.rig.frames import (
    PROTOCOL_VERSION,
    BoardKind,
    BoardState,
    Command,
    Decoder,
    Hello,
    Identify,
    Mode,
    Sample,
    Valve,
    Vent,
    encode,
)
from tests.instrument.driving import adc_sum_of


class Board(threading.Thread):
    """Obeys at once and streams 500 samples a second; its log is what it heard, and when."""

    def __init__(self, uptime_ms=1000, version=PROTOCOL_VERSION, silence_ms=250, vent_after_ms=2000):
        super().__init__(daemon=True)
        self.far, self._near = os.openpty()
        tty.setraw(self._near)
        self.path = os.ttyname(self._near)
        self.heard = []
        self.state = BoardState.VENTED
        self.mute = False
        self.uptime_ms, self.version = uptime_ms, version
        self.silence_ms, self.vent_after_ms = silence_ms, vent_after_ms
        self.deaf_to_time_outs = False
        self.noise = b""
        self._identified = False
        self._started_s = time.monotonic()
        self._samples = self._obeyed = 0
        self._decoder = Decoder.of_host()
        self._ended = threading.Event()

    def run(self):
        due_s = time.monotonic()
        with contextlib.suppress(OSError):
            while not self._ended.is_set():
                due_s = max(due_s + 0.002, time.monotonic() - 0.02)
                while select.select([self.far], [], [], max(0.0, due_s - time.monotonic()))[0]:
                    self._listen(os.read(self.far, 4096))
                self._speak()

    def _listen(self, data):
        for frame in self._decoder.feed(data):
            message = frame.message
            self.heard.append((time.monotonic(), message))
            if isinstance(message, Identify):
                self._identified = self.version == PROTOCOL_VERSION
                self._send(self._hello())
            elif isinstance(message, Vent):
                self.state = BoardState.VENTED
            elif isinstance(message, Command):
                self._obeyed = frame.sequence & 0xFF
                self.state = BoardState.HOLDING if message.mode == Mode.HOLD else BoardState.VENTED
                if not self.deaf_to_time_outs:
                    self.vent_after_ms = message.vent_after_ms

    def _hello(self):
        return Hello(BoardKind.EMULATED, 0x100, self._age_ms(), 7, self.silence_ms, self.vent_after_ms)

    def _age_ms(self):
        return self.uptime_ms + round((time.monotonic() - self._started_s) * 1e3)

    def _speak(self):
        if self.noise:
            os.write(self.far, self.noise)
        if self._identified and not self.mute:
            held = self.state is BoardState.HOLDING
            pressure_kpa, valves, setpoint_pa = (8.0, Valve.VENT_CLOSED, 8000) if held else (0.0, 0, 0)
            adc_sum, time_us = adc_sum_of(pressure_kpa + 0.2), self._samples * 2000
            self._send(Sample(time_us, adc_sum, 5000, valves, self.state, 0, 0, self._obeyed, setpoint_pa))

    def _send(self, message):
        os.write(self.far, encode(message, self._samples, self.version))
        self._samples += isinstance(message, Sample)

    def restart(self):
        """Like a brown-out: vented, forgotten, and a greeting of its own."""
        self.state, self._identified, self._samples = BoardState.VENTED, False, 0
        self.uptime_ms, self._started_s = 0, time.monotonic()
        self._send(self._hello())

    def messages(self, kind):
        return [(t_s, message) for t_s, message in list(self.heard) if isinstance(message, kind)]

    def end(self):
        self._ended.set()
        if self.is_alive():
            self.join(5.0)
        for descriptor in (self.far, self._near):
            with contextlib.suppress(OSError):
                os.close(descriptor)


class Cable:
    """A symlink that stands for the port's name, and the boards that were at its end."""

    def __init__(self, path):
        self.path, self.boards = path, []

    def plug(self, **board):
        self.boards.append(Board(**board))
        self.path.unlink(missing_ok=True)
        self.path.symlink_to(self.boards[-1].path)
        self.boards[-1].start()
        return self.boards[-1]

    def pull(self):
        self.path.unlink()
        self.boards[-1].end()
