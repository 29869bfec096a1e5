"""Board that a test controls byte by byte: its samples can have any sequence number, time and state."""

from dataclasses import dataclass, field

from pneuforce.instrument.core.controller import Instrument
from pneuforce.instrument.core.session import Session
from pneuforce.instrument.core.settings import Settings
from pneuforce.instrument.rig.firmware import CURRENT_VERSION
from pneuforce.protocol.firmware_images import IMAGES
from pneuforce.protocol.frames import (
    BoardKind,
    BoardState,
    Command,
    FrameDecoder,
    Hello,
    Image,
    Mode,
    Sample,
    Valve,
    encode,
)
from pneuforce.protocol.limits import PRESSURISED
from tests.instrument.instrument_harness import DT_S, HOLD_8, PLC, VENT, adc_sum_of
from tests.instrument.prepared import prepared_once

FILLING_S, SETTLING_S = 0.4, 0.4
TICK_STEPS = 5


@dataclass
class ForgedBoard:
    """Session in virtual time with a board that sends one sample per 2 ms and follows each command.

    `sequence_of`, `time_us_of` and `state_of` replace the values of a sample. Each function gets the number
    of the sample since the boot; `state_of` also gets the state in which an honest board is.
    """

    session: Session = field(default_factory=lambda: Session(Instrument(Settings())))
    now_s: float = 1000.0
    number: int = 0
    sequence_of: object = lambda number: number
    time_us_of: object = lambda number: 2000 * number
    state_of: object = lambda number, state: state
    hold_s: float | None = None  #: time since the present hold began; None without a hold
    command: int = 0
    sent: bytes = b""

    def __post_init__(self):
        self.session.attach(self.now_s)
        hello = Hello(BoardKind.REAL, CURRENT_VERSION, 1000, 7, 250, 2000)
        self.sent = encode(Image(IMAGES[CURRENT_VERSION]), 0) + encode(hello, 0)
        self.decoder = FrameDecoder.for_host_frames()

    @classmethod
    @prepared_once
    def holding(cls, **changes):
        """Return a board that has held 8 kPa for some time."""
        board = cls(**changes)
        board.run(1.5)
        board.write_ok(VENT)
        board.write_ok(HOLD_8)
        board.run(2.0)
        assert board.snapshot().state == "holding"
        assert "force_valid" in board.snapshot().status
        return board

    @property
    def honest_state(self):
        if self.hold_s is None:
            return BoardState.VENTED
        if self.hold_s < FILLING_S:
            return BoardState.INFLATING
        return BoardState.SETTLING if self.hold_s < FILLING_S + SETTLING_S else BoardState.HOLDING

    def step(self):
        """Advance by 2 ms: send one sample, and receive the commands of the host at each fifth step."""
        self.now_s += DT_S
        self.number += 1
        if self.hold_s is not None:
            self.hold_s += DT_S
        self.send_sample()
        if self.number % TICK_STEPS == 0:
            self.session.tick(self.now_s)
            self.receive(self.session.outgoing(self.now_s))

    def send_sample(self, **changes):
        held = self.honest_state in PRESSURISED
        values = {
            "board_time_us": self.time_us_of(self.number) % 2**32,
            "adc_sum": adc_sum_of((8.0 if held else 0.0) + 0.3),
            "supply_mv": 5000,
            "valves": Valve.VENT_CLOSED if held else Valve.NONE,
            "state": self.state_of(self.number, self.honest_state),
            "fault": 0,
            "faults": 0,
            "command": self.command,
            "setpoint_pa": 8000 if held else 0,
        }
        self.send(encode(Sample(**values | changes), self.sequence_of(self.number) & 0xFFFF))

    def send(self, data):
        """Pass bytes of the board to the session, after the bytes in `sent`."""
        data, self.sent = self.sent + data, b""
        for raw in self.session.receive(data, self.now_s):
            self.session.process(raw, self.now_s)

    def receive(self, data):
        for frame in self.decoder.feed(data):
            if isinstance(frame.message, Command):
                self.command = frame.sequence & 0xFF
                held = frame.message.mode == Mode.HOLD
                self.hold_s = (0.0 if self.hold_s is None else self.hold_s) if held else None

    def run(self, seconds, until=lambda: False):
        """Run for a time, or until a condition is true. Return the elapsed time [s]."""
        for step in range(round(seconds / DT_S)):
            if until():
                return step * DT_S
            self.step()
        return seconds

    def run_until_tripped(self, limit_s=10.0):
        """Run until the rig trips. Return the elapsed time [s], which is `limit_s` without a trip."""
        return self.run(limit_s, lambda: self.snapshot().faults)

    def snapshot(self):
        return self.session.instrument.snapshot(PLC, self.now_s)

    def write_ok(self, request):
        assert str(self.session.write(PLC, request, self.now_s)) == "none"
