"""The host's end of the rig link, without I/O: greeting, keep-alive, sequence and silence."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum, auto

from instrument.errors import ProtocolMismatch, TimeOutMismatch
from instrument.rig.clock import MOST_RATE_ERROR, BoardClock
from instrument.rig.echo import CommandEcho
from instrument.rig.frames import (
    COUNTS_LIMIT,
    PROTOCOL_VERSION,
    SAMPLES_PER_S,
    BoardState,
    Command,
    Decoder,
    Event,
    Frame,
    Hello,
    Identify,
    Message,
    Mode,
    Sample,
    Vent,
    encode,
)
from instrument.rig.limits import HOST_SILENCE_S

IDENTIFY_EVERY_S = 0.2
AGREE_S = 1.0  #: a board that was told when to vent has to say so within this time
KEEP_ALIVE_S = 0.05
#: A board's uptime may lag behind ours by its clock's error and by this, without having restarted.
RESTART_MS = 250
UPTIME_WRAP_MS = 2**32
#: A gap in the samples is bridged, but never by more than this [s].
LONGEST_STEP_S = 0.5
BRIDGED_S = 0.02  #: the most that one sample can vouch for: what went on in a longer gap is not known
FROZEN_FRAMES = 10
OLD_STEP = 0x8000  #: a sequence this far ahead is one from behind: a frame that comes again
_STATES = frozenset(BoardState)


class Phase(Enum):
    """How far host and board have come."""

    GREETING = auto()  #: Identify is sent until samples come: a board streams to a host of its version only
    AGREEING = auto()  #: samples are used; the board is told to vent, and asked after which silence it would
    READY = auto()  #: samples are used, commands are sent


@dataclass(frozen=True, slots=True)
class RawSample:
    """A sample still in counts, with its sequence and when the board took it, by the host's clock [s]."""

    sequence: int
    t_s: float
    message: Sample
    elapsed_s: float = 1 / SAMPLES_PER_S  #: board time since the sample before, at most 0.5 s
    frozen: bool = False  #: the board's clock has stood still for 10 samples
    clock_off: bool = False  #: the board's clock is wrong by more than 1 %


@dataclass(slots=True)
class Link:
    """Bytes from the board become samples; the wanted command becomes bytes for the board."""

    vent_after_ms: int = 2_000  #: what the host was configured for; a board that does otherwise is refused
    phase: Phase = Phase.GREETING
    clock: BoardClock = field(default_factory=BoardClock)
    echo: CommandEcho = field(default_factory=CommandEcho)
    hello: Hello | None = None
    board_restarts: int = 0  #: greetings by another board, or with less uptime than it must have
    lost_frames: int = 0  #: gaps in the sequence
    repeated_frames: int = 0
    implausible_frames: int = 0  #: samples with a value that no board can send
    heard_bytes: int = 0
    command_sequence: int = 0  #: sequence of the last command sent
    events: list[Event] = field(default_factory=list)  #: not yet taken by the host
    decoder: Decoder = field(default_factory=Decoder.of_board)
    _last: tuple[int, Sample] | None = None
    _still_frames: int = 0
    _greeted_s: float = 0.0
    _agreeing_s: float = float("inf")
    _sent_s: float = float("-inf")
    _sent: Command | None = None
    _vent_asked: bool = False

    def restart(self) -> None:
        """Begin with a greeting again: the port was opened anew, or the board restarted."""
        self.phase = Phase.GREETING
        self._last = None
        self._still_frames = 0
        self.clock.restart()
        self.echo = CommandEcho()
        self._sent_s = float("-inf")
        self._sent = None
        self.decoder = Decoder.of_board()

    def forget(self) -> None:
        """The board is none of ours: whoever comes next has to greet."""
        self.hello = None

    def feed(self, data: bytes, now_s: float) -> list[RawSample]:
        """Samples completed by `data`.

        Raises ProtocolMismatch where a board of another version greets, TimeOutMismatch where it reacts to
        a silent host after another time than this host counts on.
        """
        self.heard_bytes += len(data)
        samples: list[RawSample] = []
        for frame in self.decoder.feed(data):
            message = frame.message
            if isinstance(message, Sample):
                before_us = self._board_time_us
                if self._is_new(frame, message, now_s):
                    samples.append(self._raw(frame.sequence, message, before_us, now_s))
            elif isinstance(message, Hello):
                self._greet(message, frame.version, now_s)
            elif isinstance(message, Event) and {message.state, message.was} <= _STATES:
                self.events.append(message)
        return samples

    def _is_new(self, frame: Frame, message: Sample, now_s: float) -> bool:
        if message.state not in _STATES or message.adc_sum > COUNTS_LIMIT:
            self.implausible_frames += 1
            return False
        if self.hello is None:
            return False
        last = self._last
        step = (frame.sequence - last[0]) & 0xFFFF if last else 1
        if step == 0 or step >= OLD_STEP:
            self.repeated_frames += 1
            return False
        self._last = (frame.sequence, message)
        if self.phase is Phase.GREETING:
            self.phase, self._agreeing_s = Phase.AGREEING, float("inf")
            self._agree(self.hello, now_s)
        self.lost_frames += step - 1
        return True

    @property
    def _board_time_us(self) -> int | None:
        """Board time of the last sample, None before the first."""
        return self._last[1].board_time_us if self._last else None

    def _raw(self, sequence: int, message: Sample, before_us: int | None, now_s: float) -> RawSample:
        latest_s = self.echo.latest_s(message.command)
        if before_us is None:
            return RawSample(sequence, self.clock.taken_s(message.board_time_us, now_s, latest_s), message)
        passed_us = (message.board_time_us - before_us) & 0xFFFF_FFFF
        self._still_frames = 0 if passed_us else self._still_frames + 1
        frozen = self._still_frames >= FROZEN_FRAMES
        if frozen:
            self.clock.restart()
        t_s = self.clock.taken_s(message.board_time_us, now_s, latest_s)
        elapsed_s = min(passed_us * 1e-6, LONGEST_STEP_S)
        return RawSample(sequence, t_s, message, elapsed_s, frozen, self.clock.off)

    def _greet(self, hello: Hello, version: int, now_s: float) -> None:
        if version != PROTOCOL_VERSION:
            raise ProtocolMismatch(version, PROTOCOL_VERSION)
        if hello.host_silence_ms != round(HOST_SILENCE_S * 1e3):
            raise TimeOutMismatch("shuts its inlet", hello.host_silence_ms, round(HOST_SILENCE_S * 1e3))
        if self.hello is not None:
            passed_ms = (now_s - self._greeted_s) * 1e3 * (1 - MOST_RATE_ERROR)
            least_ms = (self.hello.uptime_ms + passed_ms) % UPTIME_WRAP_MS - RESTART_MS
            if hello.uptime_ms < least_ms or hello.serial != self.hello.serial:
                self.board_restarts += 1
                self.restart()
        self.hello, self._greeted_s = hello, now_s
        if self.phase is Phase.AGREEING:
            self._agree(hello, now_s)

    def _agree(self, hello: Hello, now_s: float) -> None:
        """Compare when the board vents with when it is meant to; it learns of that with the first command."""
        if hello.vent_after_ms == self.vent_after_ms:
            self.phase = Phase.READY
        elif now_s > self._agreeing_s + AGREE_S:
            raise TimeOutMismatch("vents", hello.vent_after_ms, self.vent_after_ms)

    def vent(self) -> None:
        """Ask for the vent message in front of whatever is sent next, once."""
        self._vent_asked = True

    def tick(self, wanted: Command, now_s: float) -> bytes:
        """Bytes to send now: a greeting, or the command at every change and every 50 ms.

        Of all that moves a valve, a board that has not yet answered is sent a vent only.
        """
        urgent = self._encode(Vent()) if self._vent_asked else b""
        self._vent_asked = False
        if self.phase is Phase.GREETING:
            if now_s - self._sent_s < IDENTIFY_EVERY_S:
                return urgent
            self._sent_s = now_s
            return urgent + self._encode(Identify())
        if self.phase is Phase.AGREEING:
            return urgent + self._ask_to_agree(now_s)
        if wanted == self._sent and now_s - self._sent_s < KEEP_ALIVE_S and not urgent:
            return b""
        self._sent, self._sent_s = wanted, now_s
        return urgent + self._order(wanted, now_s)

    def _ask_to_agree(self, now_s: float) -> bytes:
        """Tell the board when to vent in a silence, and ask it: nothing is inflated before it says so."""
        if now_s - self._sent_s < KEEP_ALIVE_S:
            return b""
        self._sent_s = now_s
        self._agreeing_s = min(self._agreeing_s, now_s)
        vent = Command(mode=Mode.VENT, vent_after_ms=self.vent_after_ms)
        return self._order(vent, now_s) + self._encode(Identify())

    def _order(self, command: Command, now_s: float) -> bytes:
        data = self._encode(command)
        self.echo.sent(self.command_sequence, now_s)
        return data

    def _encode(self, message: Message) -> bytes:
        self.command_sequence = (self.command_sequence + 1) & 0xFFFF
        return encode(message, self.command_sequence)
