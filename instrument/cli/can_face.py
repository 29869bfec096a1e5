"""The CAN face: the node's frames go out, frames received come in on the loop's thread."""

from __future__ import annotations

import asyncio
import logging
import time
from collections import defaultdict
from dataclasses import dataclass
from functools import partial
from importlib.metadata import version

from instrument.aside import aside, unless
from instrument.cli.loop import Shown
from instrument.config import Can
from instrument.errors import FaceError
from registers.can.bus import BusAt, load
from registers.can.inbox import Inbox
from registers.can.live import SAY_PERIOD_S, CanBus
from registers.can.node import CanNode
from registers.can.options import Options
from registers.can.tally import Tally
from registers.can.wire import CanFrame
from registers.canopen.node import CanopenNode
from registers.canopen.readings import Identity
from registers.source import Source
from registers.sparing_log import SparingLog

log = logging.getLogger("pneuforce")


def options_of(own: Can) -> Options:
    """The node's options. Raises FaceError: a bus load above 60 %."""
    try:
        return Options(node_id=own.node_id, force_rate_hz=own.force_rate_hz, bit_rate=own.bit_rate)
    except ValueError as error:
        raise FaceError(str(error)) from None


def node_of(source: Source, own: Can) -> CanNode | CanopenNode:
    """The node of a configuration. Raises FaceError: a bus load above 60 %."""
    if own.mode == "canopen":
        return CanopenNode(source, options_of(own), Identity(software=version("pneuforce")))
    return CanNode(source, options_of(own))


@dataclass(slots=True)
class Sighting:
    """The last frame with one identifier."""

    data: bytes = b""
    count: int = 0
    at_s: float = 0.0

    def note(self, data: bytes, now_s: float) -> None:
        """One more."""
        self.data, self.at_s = data, now_s
        self.count += 1


class CanFace:
    """A node on a live bus, told of samples and time by the host."""

    def __init__(self, source: Shown, own: Can) -> None:
        """Set up the node. Raises FaceError: a bus load above 60 %."""
        self.node = node_of(source, own)
        load(own.interface)
        at = BusAt(interface=own.interface, channel=own.channel, host=own.host, port=own.port)
        self.bus = CanBus(at, self._hand_over)
        self._inbox = Inbox(self.node.is_vent)
        #: By identifier, and whether the node sent it.
        self.sighted: defaultdict[tuple[int, bool], Sighting] = defaultdict(Sighting)
        self._namesakes = 0
        self._errors = 0
        self._say = SparingLog(log, SAY_PERIOD_S).say
        self._tally = Tally()
        self._source = source
        self._loop = asyncio.get_running_loop()

    async def open(self, stop: asyncio.Event) -> None:
        """Open the bus and see that the node id is free: 1.2 s, or until `stop` is set. Raises FaceError."""
        try:
            await unless(stop, aside(partial(self.bus.open, self.node.own_ids)))
        except OSError as error:
            raise FaceError(str(error)) from None

    def on_sample(self, now_s: float) -> None:
        """Send what is due at a new sample."""
        self._send(self.node.on_sample(now_s), now_s)

    def tick(self, now_s: float) -> None:
        """Send what is due by time, and tell the source how the bus is."""
        self._source.can_down = not self.bus.is_up
        self._send(self.node.tick(now_s), now_s)
        if line := self._tally.line(self._counts(), now_s):
            log.warning("CAN: %s", line)

    def _counts(self) -> dict[str, int]:
        of_bus = self.bus.counters
        return {
            "frames not sent": self.bus.dropped,
            "error frames": of_bus.error_frames,
            "frames with our identifiers ignored": self.node.counters.ignored,
            "frames cut from a flood": self._inbox.dropped,
            "errors of ours": of_bus.errors + self._errors,
            f"frames of another node with our id {self.node.options.node_id}": self._namesakes,
        }

    def close(self) -> None:
        """Let the bus go."""
        self.bus.close()

    def _hand_over(self, frame: CanFrame) -> None:
        """Called in the bus's thread."""
        if self.node.hears(frame) and self._inbox.put(frame):
            self._loop.call_soon_threadsafe(self._take_one)

    def _take_one(self) -> None:
        frame = self._inbox.take()
        self._namesakes += frame.id in self.node.own_ids and not frame.kind
        now_s = time.monotonic()
        self.sighted[frame.id, False].note(frame.data, now_s)
        try:
            self._send(self.node.receive(frame, now_s), now_s)
        except Exception:
            self._errors += 1
            self._say(now_s, "CAN frame %03Xh dropped after an error of ours", frame.id, trace=True)

    def _send(self, frames: list[CanFrame], now_s: float) -> None:
        for frame in frames:
            self.bus.send(frame)
            self.sighted[frame.id, True].note(frame.data, now_s)
