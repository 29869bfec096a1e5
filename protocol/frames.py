"""The frames of the rig link: what host and board say to each other, byte for byte.

Every frame has the same 24 bytes, so that nothing in it can lie about its length:

    A5 5A · kind u8 · version u8 · sequence u16 · payload (16 bytes) · CRC u16       (little-endian)

The CRC is CRC-16/IBM-3740 (x^16 + x^12 + x^5 + 1, start FFFFh) over kind … payload: it detects every
error of up to 3 bits and every burst of up to 16 bits. A damaged frame costs itself only: the decoder
looks for the next start within the bytes that it refused.
"""

from __future__ import annotations

import struct
from binascii import crc_hqx
from dataclasses import dataclass, field
from enum import IntEnum, IntFlag
from operator import attrgetter
from typing import ClassVar, Self

PROTOCOL_VERSION = 1
BAUD = 500_000
SAMPLES_PER_S = 500
SYNC = b"\xa5\x5a"
FRAME_BYTES = 24
OVERSAMPLING = 16  #: conversions in one ADC sum
ADC_FULL_SCALE = 1024 * OVERSAMPLING
COUNTS_LIMIT = 1023 * OVERSAMPLING

_HEAD = struct.Struct("<BBH")
_CRC = struct.Struct("<H")


class BoardKind(IntEnum):
    """What sits at the far end, from the board's EEPROM or from the simulator."""

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


class Fault(IntEnum):
    """Why the board tripped; bit `1 << code` of the sample's `faults` while it is latched."""

    NONE = 0
    SENSOR = 1  #: open, short: ADC below 1 % or above 98 % of full scale
    STUCK = 2  #: the ADC sum does not move while a valve is open
    SUPPLY_VOLTAGE = 3  #: outside 4.75–5.25 V
    OVERPRESSURE = 4
    BURST = 5  #: pressure fell by half within 100 ms
    LIMIT_POINT = 6  #: inlet open and the pressure falls
    NO_RISE = 7  #: inlet open and no rise: no supply, or inlet shut
    INLET_OPEN = 8  #: pressure rises with the inlet closed
    VENT_SHUT = 9  #: pressure does not fall with the vent open
    OCCLUSION = 10  #: pressure moves far faster than the commissioned time constant
    LEAK = 11
    TIMEOUT = 12  #: setpoint not reached in 15 s or 20 valve actions
    HOST_SILENT = 13
    WATCHDOG = 14  #: restarted by watchdog or brown-out


class Valve(IntFlag):
    """Energised valves. De-energised is SAFE: the inlet is normally closed, the vent normally open."""

    NONE = 0
    INLET_OPEN = 1
    VENT_CLOSED = 2


class CommandFlag(IntFlag):
    """What the host knows and the board must."""

    NONE = 0
    IN_CONTACT = 1  #: no topping up now
    ZEROED = 2  #: `zero_pa` is a taken zero: inflation is allowed


class Mode(IntEnum):
    """What the host asks of the valves."""

    VENT = 0
    HOLD = 1


@dataclass(frozen=True, slots=True)
class Sample:
    """Board → host, 500 per second."""

    kind: ClassVar[int] = 0x33
    layout: ClassVar[struct.Struct] = struct.Struct("<IHHBBBHBH")

    board_time_us: int  #: board clock, wraps at 2³² µs
    adc_sum: int  #: sum of 16 conversions of the pressure sensor, ratiometric to the supply
    supply_mv: int  #: supply of sensor and ADC reference
    valves: int  #: `Valve` mask
    state: int  #: `BoardState`
    fault: int  #: first latched `Fault`, 0 where there is none
    faults: int  #: mask of latched faults
    command: int  #: low byte of the sequence of the last command obeyed
    setpoint_pa: int  #: setpoint in effect, 0 where there is none


@dataclass(frozen=True, slots=True)
class Hello:
    """Board → host, at boot and in answer to Identify."""

    kind: ClassVar[int] = 0x55
    layout: ClassVar[struct.Struct] = struct.Struct("<BHIIHHx")

    board: int  #: `BoardKind`
    firmware: int  #: revision, major · 256 + minor
    uptime_ms: int
    serial: int
    host_silence_ms: int  #: the inlet closes when the host is silent for this long
    vent_after_ms: int  #: and the rig vents after this


@dataclass(frozen=True, slots=True)
class Event:
    """Board → host, when a state or a fault changes."""

    kind: ClassVar[int] = 0x66
    layout: ClassVar[struct.Struct] = struct.Struct("<IBBBxxxxxxxxx")

    board_time_us: int
    state: int  #: state entered
    was: int  #: state left
    fault: int  #: fault that caused it, 0 where none did


@dataclass(frozen=True, slots=True)
class Identify:
    """Host → board: who are you? The frame's version is the host's."""

    kind: ClassVar[int] = 0x99
    layout: ClassVar[struct.Struct] = struct.Struct("<16x")


@dataclass(frozen=True, slots=True)
class Command:
    """Host → board, every 50 ms and at every change: keep-alive, setpoint and mode in one.

    It states what is wanted, not a step to take, so that a lost one does no harm. The board inflates
    only when it has obeyed mode VENT since its last trip, and then sees HOLD.
    """

    kind: ClassVar[int] = 0xAA
    layout: ClassVar[struct.Struct] = struct.Struct("<BBHhHHB5x")

    mode: int = Mode.VENT
    flags: int = CommandFlag.NONE
    setpoint_pa: int = 0
    zero_pa: int = 0  #: what the sensor reads when vented
    contact_limit_pa: int = 18_000  #: overpressure limit of the locked balloon
    vent_after_ms: int = 2_000  #: host silence after which the board vents
    clear: int = 0  #: a new value clears latched faults whose cause is gone


@dataclass(frozen=True, slots=True)
class Vent:
    """Host → board: vent now, from any state."""

    kind: ClassVar[int] = 0xCC
    layout: ClassVar[struct.Struct] = struct.Struct("<16x")


Message = Sample | Hello | Event | Identify | Command | Vent
#: Kinds differ in at least four bits, so that three flipped bits cannot turn one into another.
KINDS: dict[int, type[Message]] = {m.kind: m for m in (Sample, Hello, Event, Identify, Command, Vent)}
_VALUES = {kind: attrgetter(*m.__slots__) if m.__slots__ else None for kind, m in KINDS.items()}
FROM_BOARD = (Sample, Hello, Event)
FROM_HOST = (Identify, Command, Vent)


@dataclass(frozen=True, slots=True)
class Frame:
    """A message with the header that it came in."""

    sequence: int
    message: Message
    version: int = PROTOCOL_VERSION


def encode(message: Message, sequence: int, version: int = PROTOCOL_VERSION) -> bytes:
    """The 24 bytes of a message."""
    values = _VALUES[message.kind]
    payload = message.layout.pack(*(values(message) if values else ()))
    body = _HEAD.pack(message.kind, version, sequence & 0xFFFF) + payload
    return SYNC + body + _CRC.pack(crc_hqx(body, 0xFFFF))


@dataclass(slots=True)
class Decoder:
    """Bytes in, frames out; what is not a frame of the expected side is counted, never raised.

    A frame of another protocol version is passed on only when it is a greeting (Hello, Identify): the
    versions are compared there.
    """

    expects: tuple[type[Message], ...]
    refused: int = 0  #: candidates with a wrong CRC, kind or version
    skipped_bytes: int = 0  #: bytes that belonged to no frame
    _buffer: bytearray = field(default_factory=bytearray)

    @classmethod
    def of_board(cls) -> Self:
        """The host's ear."""
        return cls(FROM_BOARD)

    @classmethod
    def of_host(cls) -> Self:
        """The board's ear."""
        return cls(FROM_HOST)

    def feed(self, data: bytes) -> list[Frame]:
        """Frames completed by `data`, in order."""
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
            frame = self._frame(bytes(buffer[start + 2 : start + FRAME_BYTES]))
            if frame is None:
                self.refused += 1
                self.skipped_bytes += 1
                position = start + 1
                continue
            frames.append(frame)
            position = start + FRAME_BYTES
        del buffer[:start]
        return frames

    def _frame(self, body: bytes) -> Frame | None:
        if crc_hqx(body[:-2], 0xFFFF) != _CRC.unpack_from(body, len(body) - 2)[0]:
            return None
        kind, version, sequence = _HEAD.unpack_from(body)
        message_type = KINDS.get(kind)
        if message_type not in self.expects:
            return None
        if version != PROTOCOL_VERSION and message_type not in (Hello, Identify):
            return None
        return Frame(sequence, message_type(*message_type.layout.unpack_from(body, _HEAD.size)), version)
