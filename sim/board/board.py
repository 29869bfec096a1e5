"""Board side of the rig link: processes the received bytes and returns the bytes to send, once per sample."""

from __future__ import annotations

from pneuforce.protocol.firmware_images import IMAGES
from pneuforce.protocol.frames import (
    PROTOCOL_VERSION,
    SAMPLES_PER_S,
    BoardKind,
    Command,
    Event,
    Fault,
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
from pneuforce.protocol.limits import HELD, HOST_SILENCE_S
from pneuforce.sim.board.pressure_control import PressureController
from pneuforce.sim.board.states import UNEXPECTED_RESETS, ResetCause

FIRMWARE_REVISION = 0x0102
HELLO_INTERVAL_US = 200_000
SAMPLE_S = 1 / SAMPLES_PER_S


class SimulatedBoard:
    """Simulated board, booted by its constructor. It sends samples only to a host of its protocol version."""

    def __init__(self, serial: int = 1, reset_cause: ResetCause = ResetCause.POWER_ON) -> None:
        self.serial = serial
        #: CRC of the firmware that sends the same bytes as this board
        self.image_crc = IMAGES.get(FIRMWARE_REVISION, 0)
        self.reset_cause = reset_cause
        self.version = PROTOCOL_VERSION  #: protocol version of all sent frames and of a valid Identify
        self.samples = 0  #: samples sent since boot; the low 16 bits are the sequence number of the frame
        self._pressure = PressureController()
        self._decoder = FrameDecoder.for_host_frames()
        self._identified = False
        self._last_command = 0  # low byte of the sequence number of the last command
        self._other_frames = 0  # number of sent frames that are not samples
        self._time_us = 0
        self._last_hello_us: int | None = None
        if reset_cause in UNEXPECTED_RESETS:
            self._pressure.latch_unexpected_reset()

    @property
    def valves(self) -> int:
        """Return the `Valve` mask of the valves that the board powers now."""
        return self._pressure.status.valves

    @property
    def is_holding(self) -> bool:
        """Return True if the balloon is held at its setpoint."""
        return self._pressure.status.state in HELD

    def step(self, board_time_us: int, adc_sum: int, supply_mv: int, received: bytes) -> bytes:
        """Process the received bytes and one sample, `board_time_us` after the boot.

        Return the bytes to send.
        """
        self._time_us = board_time_us
        answers = (
            b"".join([self._handle(frame) for frame in self._decoder.feed(received)]) if received else b""
        )
        self._pressure.step(adc_sum, supply_mv, SAMPLE_S)
        return answers + self._periodic_hello() + self._events() + self._sample(adc_sum)

    def _handle(self, frame: Frame) -> bytes:
        """Answer an Identify or apply a command. Before the Identify, only a Vent message has an effect."""
        message = frame.message
        if isinstance(message, Identify):
            if frame.version == self.version:
                self._identified = True
                self._pressure.host_identified()
            return self._identification()
        if isinstance(message, Vent):
            self._pressure.vent()
        elif isinstance(message, Command) and self._identified and message.mode in tuple(Mode):
            self._last_command = frame.sequence & 0xFF
            self._pressure.apply(message)
        return b""

    def _periodic_hello(self) -> bytes:
        """Return a Hello if one is due: five times a second until a host has sent Identify."""
        if self._identified:
            return b""
        due = self._last_hello_us is None or self._time_us - self._last_hello_us >= HELLO_INTERVAL_US
        return self._identification() if due else b""

    def _identification(self) -> bytes:
        """Return an Image and a Hello."""
        self._last_hello_us = self._time_us
        image = self._encode_other(Image(self.image_crc))
        return image + self._encode_other(
            Hello(
                board=BoardKind.SIMULATED,
                firmware=FIRMWARE_REVISION,
                uptime_ms=self._time_us // 1000 & 0xFFFF_FFFF,
                serial=self.serial,
                host_silence_ms=round(HOST_SILENCE_S * 1e3),
                host_timeout_ms=round(self._pressure.status.host_timeout_s * 1e3),
            )
        )

    def _events(self) -> bytes:
        if not self._pressure.changes:
            return b""
        changes, self._pressure.changes = self._pressure.changes, []
        if not self._identified:
            return b""
        time_us = self._time_us & 0xFFFF_FFFF
        return b"".join(self._encode_other(Event(time_us, *change)) for change in changes)

    def _encode_other(self, message: Message) -> bytes:
        """Return the frame of a message that is not a sample."""
        self._other_frames += 1
        return encode(message, self._other_frames, self.version)

    def _sample(self, adc_sum: int) -> bytes:
        if not self._identified:
            return b""
        self.samples += 1
        status = self._pressure.status
        return encode(
            Sample(
                board_time_us=self._time_us & 0xFFFF_FFFF,
                adc_sum=adc_sum,
                supply_mv=status.supply.mean_mv,
                valves=status.valves,
                state=status.state,
                fault=status.latched_faults[0] if status.latched_faults else Fault.NONE,
                faults=sum([1 << fault for fault in status.latched_faults]),
                command=self._last_command,
                setpoint_pa=round(status.setpoint_kpa * 1e3),
            ),
            self.samples,
            self.version,
        )
