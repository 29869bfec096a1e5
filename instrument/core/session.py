"""Session: the rig link and the instrument together, without I/O. Time is an argument.

Each call is recorded as an entry before it is executed. The same calls in the same order give the same
results, bit for bit.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from pneuforce.errors import ProtocolMismatch, TimeoutMismatch
from pneuforce.instrument.core.controller import Instrument
from pneuforce.instrument.core.faults import HostFault
from pneuforce.instrument.core.lease import Peer
from pneuforce.instrument.core.reject_reason import RejectReason
from pneuforce.instrument.measurement.measurement import Measurement
from pneuforce.instrument.rig.link import Link, LinkPhase, RawSample
from pneuforce.instrument.stream.entry import EntryKind

MAX_SILENCE_S = 1.0  #: time without samples after which the handshake with the board starts again


class EntrySink(Protocol):
    """Destination of the entries of a session."""

    def record(self, kind: EntryKind, t_s: float, body: bytes = b"") -> None:
        """Store one entry. This method never blocks and never raises."""
        ...

    def record_tick(self, instrument: Instrument, t_s: float) -> None:
        """Store a tick of the clock."""
        ...

    def record_measurement(self, raw: RawSample, measurement: Measurement, t_s: float) -> None:
        """Store a sample and its measurement."""
        ...


class NullSink:
    """Sink that discards all entries."""

    def record(self, kind: EntryKind, t_s: float, body: bytes = b"") -> None:
        """Discard the entry."""

    def record_tick(self, instrument: Instrument, t_s: float) -> None:
        """Discard the tick."""

    def record_measurement(self, raw: RawSample, measurement: Measurement, t_s: float) -> None:
        """Discard the measurement."""


@dataclass(eq=False, repr=False)
class Session:
    """Instrument with its link: processes the bytes from the board, and returns the bytes for the board.

    A checkpoint contains all fields of the session and of the objects in these fields, except the fields with
    the metadata `{"state": False}` (`instrument/recording/checkpoint.py`).
    """

    instrument: Instrument
    sink: EntrySink = field(default_factory=NullSink, metadata={"state": False})
    link: Link = field(init=False)
    heard_s: float = 0.0  #: time of the latest samples or the latest `attach`, whichever is later
    _restarts_seen: int = 0

    def __post_init__(self) -> None:
        self.link = Link(round(self.instrument.settings.host_timeout_s * 1e3))

    def attach(self, now_s: float) -> None:
        """Start the handshake on a port that was opened."""
        self.sink.record(EntryKind.ATTACHED, now_s)
        self.heard_s = now_s
        self.link.restart()

    def detach(self, now_s: float) -> None:
        """Trip the instrument because the port was lost."""
        self.sink.record(EntryKind.DETACHED, now_s)
        self.instrument.disconnected()

    def tick(self, now_s: float) -> None:
        """Handle the passage of time in the instrument."""
        self.sink.record_tick(self.instrument, now_s)
        self.instrument.tick(now_s)

    def outgoing(self, now_s: float) -> bytes:
        """Return the bytes to send to the board now. Call this after each tick while the port is open.

        After a silence, the handshake starts again, which vents the balloon. A stall of this process is not
        a silence, because samples from the stall may still be in the buffers.
        """
        self.sink.record(EntryKind.COMMAND, now_s)
        silent = now_s - self.heard_s > MAX_SILENCE_S and not self.instrument.resuming(now_s)
        if silent and self.link.phase is not LinkPhase.GREETING:
            self.link.restart()
        return self.link.tick(self.instrument.command(), now_s)

    def receive(self, data: bytes, now_s: float) -> list[RawSample]:
        """Return the samples that `data` completes. The caller passes each sample to `process`.

        Raises ProtocolMismatch or TimeoutMismatch if the board is not compatible with this host.
        """
        self.sink.record(EntryKind.RECEIVED, now_s, data)
        self.instrument.check_stall(now_s)
        if self.instrument.link_lost(now_s):
            self.instrument.tick(now_s)  # trips: late bytes must not hide a lost link
        try:
            samples = self.link.feed(data, now_s, self.instrument.stalls.buffered_s(now_s))
        except (ProtocolMismatch, TimeoutMismatch):
            self.link.clear_hello()
            raise
        if self.link.board_restarts != self._restarts_seen:
            self._restarts_seen = self.link.board_restarts
            self.instrument.board_restarted()
        if samples:
            self.heard_s = now_s
            if self.link.hello is not None:
                self.instrument.identify_board(self.link.hello, self.link.firmware)
        return samples

    def process(self, raw: RawSample, now_s: float) -> Measurement:
        """Return the measurement of one sample."""
        measurement = self.instrument.process(raw)
        self.sink.record_measurement(raw, measurement, now_s)
        return measurement

    def write(self, peer: Peer, values: Mapping[str, Any], now_s: float) -> RejectReason:
        """Execute one write request of a bus, as `Instrument.write` describes."""
        self.sink.record(EntryKind.WRITE, now_s, json.dumps([*peer, dict(values)]).encode())
        return self.instrument.write(peer, values, now_s)

    def master_lost(self, now_s: float) -> None:
        """Trip because the heartbeat of the CANopen master is missing."""
        self.sink.record(EntryKind.MASTER_LOST, now_s)
        self.instrument.master_lost = True
        self.instrument.trip_after_contact(HostFault.CAN_MASTER_LOST, now_s)

    def master_recovered(self, now_s: float) -> None:
        """Store that the heartbeat of the CANopen master has returned, so that its fault can be cleared."""
        self.sink.record(EntryKind.MASTER_RECOVERED, now_s)
        self.instrument.master_lost = False

    def leave(self, now_s: float) -> None:
        """Vent because the host process ends."""
        self.sink.record(EntryKind.SHUTDOWN, now_s)
        self.instrument.vent(now_s)
        self.link.vent()
