"""Frames of the rig link, the serial protocol between the host process and the board.

Every frame has 24 bytes. There is no length field, so damaged bytes cannot change the length of a frame:

    A5 5A · kind u8 · version u8 · sequence u16 · payload (16 bytes) · CRC u16       (little-endian)

The CRC is CRC-16/IBM-3740 (x^16 + x^12 + x^5 + 1, initial value FFFFh) over the bytes from kind to payload.
The CRC detects every error of up to 3 bits and every burst of up to 16 bits. A damaged frame does not affect
the next frame: the decoder searches the rejected bytes for the start of another frame.
"""

from __future__ import annotations

import struct
from binascii import crc_hqx
from dataclasses import dataclass, field
from enum import IntEnum, IntFlag
from typing import ClassVar, Self

PROTOCOL_VERSION = 1
BAUD = 500_000
SAMPLES_PER_S = 500
SYNC = b"\xa5\x5a"
FRAME_BYTES = 24
OVERSAMPLING = 16  #: conversions in one ADC sum
ADC_FULL_SCALE = 1024 * OVERSAMPLING  #: ADC sum that corresponds to the reference voltage
MAX_ADC_SUM = 1023 * OVERSAMPLING  #: largest ADC sum that the converter can return

_HEAD = struct.Struct("<BBH")
_CRC = struct.Struct("<H")


class BoardKind(IntEnum):
    """Kind of board, read from the board's EEPROM or set by the simulator."""

    REAL = 0
    EMULATED = 1
    SIMULATED = 2


class BoardState(IntEnum):
    """State of the board's pressure state machine."""

    BOOT = 0
    VENTED = 1
    INFLATING = 2
    SETTLING = 3
    HOLDING = 4
    VENTING = 5
    TRIPPED = 6
    TESTING = 7  #: proof test of the held balloon: a short pulse of each valve


class Fault(IntEnum):
    """Reason for a trip. A latched fault sets bit `1 << code` in the `faults` field of a sample."""

    NONE = 0
    SENSOR = 1  #: sensor open or short: ADC below 1 % or above 98 % of full scale
    SENSOR_FROZEN = 2  #: the ADC sum does not change although a valve is open
    SUPPLY_VOLTAGE = 3  #: supply outside 4.75–5.25 V
    OVERPRESSURE = 4
    BURST = 5  #: the pressure fell by half within 100 ms
    LIMIT_POINT = 6  #: the pressure falls although the inlet is open
    NO_RISE = 7  #: the pressure does not rise although the inlet is open: no gas supply, or inlet stuck shut
    INLET_OPEN = 8  #: the pressure rises although the inlet is closed
    VENT_SHUT = 9  #: the pressure does not fall although the vent is open
    OCCLUSION = 10  #: the pressure changes much faster than at commissioning; the proof test also reports it
    LEAK = 11
    SETPOINT_TIMEOUT = 12  #: setpoint not reached in 15 s or 20 valve actions
    HOST_SILENT = 13
    WATCHDOG = 14  #: the board was restarted by its watchdog or by a brown-out


class Valve(IntFlag):
    """Mask of energised valves. 0 is SAFE: the inlet is normally closed, the vent is normally open."""

    NONE = 0
    INLET_OPEN = 1
    VENT_CLOSED = 2


class CommandFlag(IntFlag):
    """Flags by which the host reports its state to the board in each command."""

    NONE = 0
    IN_CONTACT = 1  #: the balloon is pressed, or may be: the board must not add gas
    ZEROED = 2  #: `zero_pa` is valid: the board may inflate


class Mode(IntEnum):
    """Pressure mode that the host requests."""

    VENT = 0
    HOLD = 1


@dataclass(frozen=True, slots=True)
class Sample:
    """Measurement message, board → host, 500 per second."""

    kind: ClassVar[int] = 0x33
    layout: ClassVar[struct.Struct] = struct.Struct("<IHHBBBHBH")

    board_time_us: int  #: board clock, wraps at 2³² µs
    adc_sum: int  #: sum of 16 conversions of the pressure sensor, ratiometric to the supply
    supply_mv: int  #: supply voltage of sensor and ADC reference
    valves: int  #: `Valve` mask
    state: int  #: `BoardState`
    fault: int  #: first latched `Fault`, 0 if no fault is latched
    faults: int  #: mask of latched faults
    command: int  #: low byte of the sequence number of the last command that the board applied
    setpoint_pa: int  #: setpoint in effect, 0 if there is none


@dataclass(frozen=True, slots=True)
class Hello:
    """Identification message, board → host, at boot and in answer to Identify."""

    kind: ClassVar[int] = 0x55
    layout: ClassVar[struct.Struct] = struct.Struct("<BHIIHHx")

    board: int  #: `BoardKind`
    firmware: int  #: revision, major · 256 + minor
    uptime_ms: int  #: time since the last reset
    serial: int  #: serial number of the board
    host_silence_ms: int  #: time without a command after which the board closes the inlet
    host_timeout_ms: int  #: time without a command after which the board vents


@dataclass(frozen=True, slots=True)
class Image:
    """Identification of the program in the flash of the board, board → host, before each Hello."""

    kind: ClassVar[int] = 0x3C
    layout: ClassVar[struct.Struct] = struct.Struct("<I12x")

    crc: int  #: CRC-32 (IEEE 802.3) of the program, which the board has computed at boot


@dataclass(frozen=True, slots=True)
class Event:
    """State change message, board → host, when the state or a latched fault changes."""

    kind: ClassVar[int] = 0x66
    layout: ClassVar[struct.Struct] = struct.Struct("<IBBBxxxxxxxxx")

    board_time_us: int
    state: int  #: `BoardState` entered
    previous_state: int  #: `BoardState` left
    fault: int  #: `Fault` that caused the change, 0 if the change has another cause


@dataclass(frozen=True, slots=True)
class Identify:
    """Request for a Hello, host → board. The frame carries the protocol version of the host."""

    kind: ClassVar[int] = 0x99
    layout: ClassVar[struct.Struct] = struct.Struct("<16x")


@dataclass(frozen=True, slots=True)
class Command:
    """Control message, host → board, every 50 ms and at every change.

    Each command states the complete required condition, so that the next command replaces a lost command.
    After a trip, the board inflates only if it has applied mode VENT and then receives mode HOLD.
    """

    kind: ClassVar[int] = 0xAA
    layout: ClassVar[struct.Struct] = struct.Struct("<BBHhHHBB4x")

    mode: int = Mode.VENT
    flags: int = CommandFlag.NONE
    setpoint_pa: int = 0
    zero_pa: int = 0  #: reading of the sensor while the rig is vented
    contact_limit_pa: int = 18_000  #: overpressure limit while the balloon is held
    host_timeout_ms: int = 2_000  #: time without a command after which the board vents
    clear: int = 0  #: a changed value clears the latched faults whose cause is gone
    proof_test: int = 0  #: a changed value starts a proof test, if the balloon is held and free


@dataclass(frozen=True, slots=True)
class Vent:
    """Request to vent immediately from any state, host → board."""

    kind: ClassVar[int] = 0xCC
    layout: ClassVar[struct.Struct] = struct.Struct("<16x")


Message = Sample | Hello | Image | Event | Identify | Command | Vent
#: Message types by kind. All kinds differ from each other in at least four bits. Three wrong bits therefore
#: cannot change one kind into another.
KINDS: dict[int, type[Message]] = {m.kind: m for m in (Sample, Hello, Image, Event, Identify, Command, Vent)}
BOARD_MESSAGES = (Sample, Hello, Image, Event)  #: message types, board → host
HOST_MESSAGES = (Identify, Command, Vent)  #: message types, host → board


@dataclass(frozen=True, slots=True)
class Frame:
    """A decoded message with its sequence number and protocol version."""

    sequence: int
    message: Message
    version: int = PROTOCOL_VERSION


def encode(message: Message, sequence: int, version: int = PROTOCOL_VERSION) -> bytes:
    """Return the frame (24 bytes) of a message. Only the low 16 bits of `sequence` are sent."""
    payload = message.layout.pack(*[getattr(message, name) for name in message.__slots__])
    body = _HEAD.pack(message.kind, version, sequence & 0xFFFF) + payload
    return SYNC + body + _CRC.pack(crc_hqx(body, 0xFFFF))


@dataclass(slots=True)
class FrameDecoder:
    """Decoder that converts received bytes to frames of the rig link.

    Invalid bytes and frames of the wrong direction raise no exception; they are counted. A frame with another
    protocol version is returned only if it is a Hello or an Identify, because their versions are compared.
    """

    #: Accepted message types. They are not a part of the state, because a recording has board frames only.
    expects: tuple[type[Message], ...] = field(default=BOARD_MESSAGES, metadata={"state": False})
    rejected_frames: int = 0  #: candidates with a wrong CRC, kind or version
    skipped_bytes: int = 0  #: bytes that belong to no frame
    _buffer: bytearray = field(default_factory=bytearray)

    @classmethod
    def for_board_frames(cls) -> Self:
        """Return a decoder for frames that the board sends."""
        return cls(BOARD_MESSAGES)

    @classmethod
    def for_host_frames(cls) -> Self:
        """Return a decoder for frames that the host sends."""
        return cls(HOST_MESSAGES)

    def feed(self, data: bytes) -> list[Frame]:
        """Return the frames that `data` completes, in the order of reception."""
        self._buffer += data
        buffer = self._buffer
        frames: list[Frame] = []
        position = 0
        while True:
            start = buffer.find(SYNC, position)
            if start < 0:
                keep = 1 if buffer.endswith(SYNC[:1]) else 0
                start = max(position, len(buffer) - keep)
                self.skipped_bytes += start - position
                break
            self.skipped_bytes += start - position
            if len(buffer) - start < FRAME_BYTES:
                break
            frame = self._decode(bytes(buffer[start + 2 : start + FRAME_BYTES]))
            if frame is None:
                self.rejected_frames += 1
                self.skipped_bytes += 1
                position = start + 1
                continue
            frames.append(frame)
            position = start + FRAME_BYTES
        del buffer[:start]
        return frames

    def _decode(self, body: bytes) -> Frame | None:
        """Return the frame that consists of the sync bytes and `body`, or None if this frame is invalid."""
        if crc_hqx(body[:-2], 0xFFFF) != _CRC.unpack_from(body, len(body) - 2)[0]:
            return None
        kind, version, sequence = _HEAD.unpack_from(body)
        message_type = KINDS.get(kind)
        if message_type not in self.expects:
            return None
        if version != PROTOCOL_VERSION and message_type not in (Hello, Identify):
            return None
        return Frame(sequence, message_type(*message_type.layout.unpack_from(body, _HEAD.size)), version)
