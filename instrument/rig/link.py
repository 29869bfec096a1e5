"""Host side of the rig link without I/O: handshake, keep-alive, sequence numbers, board restarts."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum, auto

from pneuforce.errors import ProtocolMismatch, TimeoutMismatch
from pneuforce.instrument.rig.board_clock import MAX_RATE_ERROR, WRAP_US, BoardClock
from pneuforce.instrument.rig.clock_check import ClockCheck
from pneuforce.instrument.rig.command_echo import CommandEcho
from pneuforce.instrument.rig.firmware import Firmware
from pneuforce.protocol.frames import (
    MAX_ADC_SUM,
    PROTOCOL_VERSION,
    SAMPLES_PER_S,
    BoardState,
    Command,
    Event,
    Frame,
    FrameDecoder,
    Hello,
    Identify,
    Image,
    Message,
    Mode,
    Sample,
    Vent,
    encode,
)
from pneuforce.protocol.limits import HOST_SILENCE_S

IDENTIFY_PERIOD_S = 0.2
#: Time in which the board must confirm the configured host timeout, and report its image.
NEGOTIATION_TIMEOUT_S = 1.0
KEEP_ALIVE_PERIOD_S = 0.05
#: Tolerance of the board's uptime, in addition to its clock error. A smaller uptime means a restart.
UPTIME_TOLERANCE_MS = 250
UPTIME_WRAP_MS = 2**32
#: Longest time since the previous sample that is counted [s]. It is longer than the memory of each filter of
#: the measuring chain.
MAX_STEP_S = 0.5
#: Longest time since the previous sample for which a sample proves the state of the rig [s]. The events in a
#: longer gap are unknown.
MAX_SAMPLE_SPAN_S = 0.02
REPEATED_STEP = 0x8000  #: if the sequence number advances by this step or more, the frame is a repetition
_STATES = frozenset(BoardState)


class LinkPhase(Enum):
    """Phase of the handshake between host and board."""

    #: The host sends Identify until samples arrive. A board sends samples only to a host with its protocol
    #: version.
    GREETING = auto()
    #: Samples are used. The board receives vent commands until it confirms the host timeout and reports its
    #: image. A board that reports no image becomes ready after 1 s.
    NEGOTIATING = auto()
    READY = auto()  #: samples are used, commands are sent


@dataclass(frozen=True, slots=True)
class RawSample:
    """Sample in ADC counts, with its sequence number and the time at which the board took the sample."""

    sequence: int
    t_s: float  #: time at which the board took the sample, on the host clock
    message: Sample
    #: Board time since the previous sample, at most 0.5 s. After a handshake, the first sample has 0.5 s.
    elapsed_s: float = 1 / SAMPLES_PER_S
    clock_invalid: bool = False  #: the board's clock has stopped, jumps or runs far too fast
    clock_off: bool = False  #: the rate error of the board's clock is above 1 %


@dataclass(slots=True)
class Link:
    """Protocol state machine that decodes received bytes to samples and encodes the requested command."""

    host_timeout_ms: int = 2_000  #: silence of the host after which the board must vent
    phase: LinkPhase = LinkPhase.GREETING
    clock: BoardClock = field(default_factory=BoardClock)
    clock_check: ClockCheck = field(default_factory=ClockCheck)
    echo: CommandEcho = field(default_factory=CommandEcho)
    hello: Hello | None = None
    image: Image | None = None  #: last Image since the start of the handshake
    board_restarts: int = 0  #: number of Hello messages that indicate a restart or another board
    lost_frames: int = 0  #: number of missing sequence numbers
    repeated_frames: int = 0
    implausible_frames: int = 0  #: samples with a value or a time that no board can send
    received_bytes: int = 0
    command_sequence: int = 0  #: sequence number of the last command
    events: list[Event] = field(default_factory=list)  #: events that the host has not processed yet
    decoder: FrameDecoder = field(default_factory=FrameDecoder.for_board_frames)
    _last: tuple[int, Sample] | None = None
    _hello_s: float = 0.0
    _negotiating_s: float = float("inf")
    _sent_s: float = float("-inf")
    _sent: Command | None = None
    _vent_requested: bool = False

    def restart(self) -> None:
        """Start the handshake again, because the port was opened again or the board restarted."""
        self.phase = LinkPhase.GREETING
        self.image = None
        self._last = None
        self.clock.restart()
        self.echo = CommandEcho()
        self._sent_s = float("-inf")
        self._sent = None
        self.decoder = FrameDecoder.for_board_frames()

    def clear_hello(self) -> None:
        """Discard the identity of an incompatible board. Samples are ignored until the next Hello."""
        self.hello = self.image = None

    @property
    def firmware(self) -> Firmware | None:
        """Return the firmware of the board, or None before the end of the handshake."""
        if self.hello is None or self.phase is not LinkPhase.READY:
            return None
        return Firmware(self.hello.firmware, self.image.crc if self.image else None)

    def feed(self, data: bytes, now_s: float, buffered_s: float = 0.0) -> list[RawSample]:
        """Return the samples that `data` completes.

        `buffered_s` is the longest time for which `data` can have waited in a buffer of the host.

        Raises ProtocolMismatch if the board has another protocol version. Raises TimeoutMismatch if a
        timeout of the board differs from the required value.
        """
        self.received_bytes += len(data)
        samples: list[RawSample] = []
        for frame in self.decoder.feed(data):
            message = frame.message
            if isinstance(message, Sample):
                before = self._last
                if self._is_new(frame, message, now_s, buffered_s):
                    samples.append(self._raw(frame.sequence, message, before, now_s))
            elif isinstance(message, Hello):
                self._receive_hello(message, frame.version, now_s, buffered_s)
            elif isinstance(message, Image):
                self.image = message
            elif isinstance(message, Event) and {message.state, message.previous_state} <= _STATES:
                self.events.append(message)
        return samples

    def _is_new(self, frame: Frame, message: Sample, now_s: float, buffered_s: float) -> bool:
        """Return True if a sample is plausible, new and from an identified board. Count lost frames."""
        if message.state not in _STATES or message.adc_sum > MAX_ADC_SUM:
            self.implausible_frames += 1
            return False
        if self.hello is None:
            return False
        if self._last is None:
            self.clock_check.start(now_s, buffered_s)
        elif not self._follows(frame.sequence, message, self._last, now_s, buffered_s):
            return False
        self._last = (frame.sequence, message)
        if self.phase is LinkPhase.GREETING:
            self.phase, self._negotiating_s = LinkPhase.NEGOTIATING, float("inf")
            self._check_host_timeout(self.hello, now_s)
        return True

    def _follows(
        self, sequence: int, message: Sample, last: tuple[int, Sample], now_s: float, buffered_s: float
    ) -> bool:
        """Return True if sequence number and time of a sample follow those of the last sample."""
        step = (sequence - last[0]) & 0xFFFF
        if step == 0 or step >= REPEATED_STEP:
            self.repeated_frames += 1
            return False
        passed_us = (message.board_time_us - last[1].board_time_us) % WRAP_US
        if not self.clock_check.allows(step, passed_us, now_s, self.host_timeout_ms * 1e-3, buffered_s):
            self.implausible_frames += 1
            return False
        self.lost_frames += step - 1
        return True

    def _raw(
        self, sequence: int, message: Sample, before: tuple[int, Sample] | None, now_s: float
    ) -> RawSample:
        """Return the sample with its time on the host clock, and the time since the sample `before`."""
        latest_s, invalid = self.echo.latest_s(message.command), self.clock_check.invalid
        if invalid:
            self.clock.restart()
        t_s = self.clock.host_time_s(message.board_time_us, now_s, latest_s)
        if invalid:
            return RawSample(sequence, t_s, message, clock_invalid=True)
        elapsed_s = MAX_STEP_S
        if before is not None:
            passed_us = (message.board_time_us - before[1].board_time_us) % WRAP_US
            elapsed_s = min(passed_us * 1e-6, MAX_STEP_S)
        return RawSample(sequence, t_s, message, elapsed_s, clock_off=self.clock.out_of_tolerance)

    def _receive_hello(self, hello: Hello, version: int, now_s: float, buffered_s: float) -> None:
        """Check the identity of a board and detect a restart by its uptime."""
        if version != PROTOCOL_VERSION:
            raise ProtocolMismatch(version, PROTOCOL_VERSION)
        if hello.host_silence_ms != round(HOST_SILENCE_S * 1e3):
            raise TimeoutMismatch("shuts its inlet", hello.host_silence_ms, round(HOST_SILENCE_S * 1e3))
        if self.hello is not None:
            passed_ms = (now_s - buffered_s - self._hello_s) * 1e3 * (1 - MAX_RATE_ERROR)
            min_uptime_ms = (self.hello.uptime_ms + passed_ms) % UPTIME_WRAP_MS - UPTIME_TOLERANCE_MS
            if hello.uptime_ms < min_uptime_ms or hello.serial != self.hello.serial:
                self.board_restarts += 1
                self.restart()
        self.hello, self._hello_s = hello, now_s
        if self.phase is LinkPhase.NEGOTIATING:
            self._check_host_timeout(hello, now_s)

    def _check_host_timeout(self, hello: Hello, now_s: float) -> None:
        """Compare the board's host timeout with the configured host timeout, and wait for the image.

        The board receives the configured value with the first command. Raises TimeoutMismatch if the board
        still reports another value after `NEGOTIATION_TIMEOUT_S`.
        """
        expired = now_s > self._negotiating_s + NEGOTIATION_TIMEOUT_S
        if hello.host_timeout_ms == self.host_timeout_ms:
            if self.image is not None or expired:
                self.phase = LinkPhase.READY
        elif expired:
            raise TimeoutMismatch("vents", hello.host_timeout_ms, self.host_timeout_ms)

    def vent(self) -> None:
        """Request one Vent message, which the next `tick` sends before all other messages."""
        self._vent_requested = True

    def tick(self, requested: Command, now_s: float) -> bytes:
        """Return the bytes to send now.

        After the handshake, the command is sent at every change and every 50 ms. Before the handshake is
        complete, the only message that can move a valve is a vent.
        """
        urgent = self._encode(Vent()) if self._vent_requested else b""
        self._vent_requested = False
        if self.phase is LinkPhase.GREETING:
            if now_s - self._sent_s < IDENTIFY_PERIOD_S:
                return urgent
            self._sent_s = now_s
            return urgent + self._encode(Identify())
        if self.phase is LinkPhase.NEGOTIATING:
            return urgent + self._negotiate(now_s)
        if requested == self._sent and now_s - self._sent_s < KEEP_ALIVE_PERIOD_S and not urgent:
            return b""
        self._sent, self._sent_s = requested, now_s
        return urgent + self._encode_command(requested, now_s)

    def _negotiate(self, now_s: float) -> bytes:
        """Return a vent command that contains the configured host timeout, and an Identify message.

        The board answers Identify with a Hello, which confirms the host timeout. The balloon is not inflated
        before this confirmation.
        """
        if now_s - self._sent_s < KEEP_ALIVE_PERIOD_S:
            return b""
        self._sent_s = now_s
        self._negotiating_s = min(self._negotiating_s, now_s)
        vent = Command(mode=Mode.VENT, host_timeout_ms=self.host_timeout_ms)
        return self._encode_command(vent, now_s) + self._encode(Identify())

    def _encode_command(self, command: Command, now_s: float) -> bytes:
        data = self._encode(command)
        self.echo.command_sent(self.command_sequence, now_s)
        return data

    def _encode(self, message: Message) -> bytes:
        self.command_sequence = (self.command_sequence + 1) & 0xFFFF
        return encode(message, self.command_sequence)
