"""Link and instrument, coupled: all that a host does but to hold the port. No I/O; time is an argument.

Each call is put on the tape before it is carried out: who makes the same calls again has the same again.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, Protocol

from instrument.core import Instrument
from instrument.errors import ProtocolMismatch, TimeOutMismatch
from instrument.faults import HostFault
from instrument.lease import Peer
from instrument.measurement import Measurement
from instrument.refusal import Refusal
from instrument.rig.link import Link, Phase, RawSample
from instrument.tape.entry import Kind

SILENT_S = 1.0  #: then the board is greeted anew


class Tape(Protocol):
    """What keeps the calls, if anybody wants them."""

    def note(self, kind: Kind, t_s: float, body: bytes = b"") -> None:
        """Keep one entry; never waits, never raises."""
        ...

    def note_beat(self, instrument: Instrument, t_s: float) -> None:
        """Keep that the host beats."""
        ...

    def note_measured(self, raw: RawSample, measurement: Measurement, t_s: float) -> None:
        """Keep a sample and what became of it."""
        ...


class NoTape:
    """The tape of an instrument that nobody listens to."""

    def note(self, kind: Kind, t_s: float, body: bytes = b"") -> None:
        """Forget it."""

    def note_beat(self, instrument: Instrument, t_s: float) -> None:
        """Forget it."""

    def note_measured(self, raw: RawSample, measurement: Measurement, t_s: float) -> None:
        """Forget it."""


class Coupling:
    """Bytes from the board in, bytes for the board out, and the instrument in between."""

    def __init__(self, instrument: Instrument, tape: Tape | None = None) -> None:
        self.instrument = instrument
        self.link = Link(round(instrument.settings.vent_after_s * 1e3))
        self.tape: Tape = tape or NoTape()
        self.heard_s = 0.0  #: when samples came last, or the port was opened
        self._restarts_seen = 0

    def attach(self, now_s: float) -> None:
        """A port was opened: whoever is there is greeted."""
        self.tape.note(Kind.ATTACHED, now_s)
        self.heard_s = now_s
        self.link.restart()

    def detach(self, now_s: float) -> None:
        """The port is gone."""
        self.tape.note(Kind.DETACHED, now_s)
        self.instrument.disconnected()

    def beat(self, now_s: float) -> None:
        """Time has passed."""
        self.tape.note_beat(self.instrument, now_s)
        self.instrument.tick(now_s)

    def orders(self, now_s: float) -> bytes:
        """What to send to the board now; to be asked for after each beat with an open port."""
        self.tape.note(Kind.ASKED, now_s)
        if now_s - self.heard_s > SILENT_S and self.link.phase is not Phase.GREETING:
            self.link.restart()
        return self.link.tick(self.instrument.command(), now_s)

    def receive(self, data: bytes, now_s: float) -> list[RawSample]:
        """Samples completed by `data`, each to be given to `take`.

        Raises ProtocolMismatch and TimeOutMismatch: the board is none of ours.
        """
        self.tape.note(Kind.RECEIVED, now_s, data)
        if self.instrument.link_lost(now_s):
            self.instrument.tick(now_s)  # a silence is one, though what was sent in it is read only now
        try:
            samples = self.link.feed(data, now_s)
        except (ProtocolMismatch, TimeOutMismatch):
            self.link.forget()
            raise
        if self.link.board_restarts != self._restarts_seen:
            self._restarts_seen = self.link.board_restarts
            self.instrument.board_restarted()
        if samples:
            self.heard_s = now_s
            if self.link.hello is not None:
                self.instrument.greeted(self.link.hello)
        return samples

    def take(self, raw: RawSample, now_s: float) -> Measurement:
        """The measurement of one sample."""
        measurement = self.instrument.take(raw)
        self.tape.note_measured(raw, measurement, now_s)
        return measurement

    def write(self, peer: Peer, values: Mapping[str, Any], now_s: float) -> Refusal:
        """Carry out one request of a bus, all or nothing; see `Instrument.write`."""
        self.tape.note(Kind.WRITE, now_s, json.dumps([*peer, dict(values)]).encode())
        return self.instrument.write(peer, values, now_s)

    def master_lost(self, now_s: float) -> None:
        """Do without the CAN master: nobody commands any more."""
        self.tape.note(Kind.MASTER_LOST, now_s)
        self.instrument.master_lost = True
        self.instrument.abandoned(HostFault.CAN_MASTER_LOST, now_s)

    def master_back(self, now_s: float) -> None:
        """Let the loss of the CAN master be cleared from now on."""
        self.tape.note(Kind.MASTER_BACK, now_s)
        self.instrument.master_lost = False

    def leave(self, now_s: float) -> None:
        """Vent, because the host ends."""
        self.tape.note(Kind.LEAVING, now_s)
        self.instrument.vent(now_s)
        self.link.vent()
