"""CAN server of the host. Received frames are queued, and the event loop passes them to the node."""

from __future__ import annotations

import asyncio
import logging
import time
from collections import defaultdict
from dataclasses import dataclass
from functools import partial
from importlib.metadata import version
from pathlib import Path

from pneuforce.errors import ServerError
from pneuforce.instrument.config import CanSection
from pneuforce.instrument.service.buses.parameter_file import storage_of
from pneuforce.instrument.service.host.loop import ServedSource
from pneuforce.registers.can.bus import CanAddress, import_interface
from pneuforce.registers.can.connection import LOG_PERIOD_S, CanConnection, NodeIdInUseError
from pneuforce.registers.can.counter_logger import CounterLogger
from pneuforce.registers.can.node import CanNode
from pneuforce.registers.can.options import CanOptions
from pneuforce.registers.can.receive_queue import ReceiveQueue
from pneuforce.registers.can.wire import CanFrame
from pneuforce.registers.canopen.node import CanopenNode
from pneuforce.registers.canopen.node_values import CanopenIdentity
from pneuforce.registers.source import Source
from pneuforce.support.background import cancel_on, run_in_background
from pneuforce.support.throttle import RateLimitedLogger

log = logging.getLogger("pneuforce")


def options_of(settings: CanSection) -> CanOptions:
    """Return the options of the node. Raises ServerError if the bus load would exceed 60 %."""
    try:
        return CanOptions(
            node_id=settings.node_id, force_rate_hz=settings.force_rate_hz, bit_rate=settings.bit_rate
        )
    except ValueError as error:
        raise ServerError(str(error)) from None


def node_of(
    source: Source, settings: CanSection, parameter_file: Path | None = None
) -> CanNode | CanopenNode:
    """Return the configured node. Raises ServerError if the bus load would exceed 60 %."""
    if settings.mode == "raw":
        return CanNode(source, options_of(settings))
    storage = storage_of(parameter_file, settings.node_id)
    identity = CanopenIdentity(software=version("pneuforce"))
    node = CanopenNode(source, options_of(settings), identity, storage)
    if storage.problem:
        log.warning("stored CANopen parameters are not used: %s: %s", parameter_file, storage.problem)
    return node


@dataclass(slots=True)
class LastFrame:
    """Last frame with one identifier, for the inspector of the web page."""

    data: bytes = b""
    count: int = 0
    at_s: float = 0.0

    def update(self, data: bytes, now_s: float) -> None:
        """Store the data of a frame and count the frame."""
        self.data, self.at_s = data, now_s
        self.count += 1


class CanServer:
    """Node on a CAN bus. The host calls it for each sample and each tick."""

    def __init__(
        self, source: ServedSource, settings: CanSection, parameter_file: Path | None = None
    ) -> None:
        """Create the node. Raises ServerError if the bus load would exceed 60 %.

        A CANopen master stores parameters in `parameter_file`.
        """
        self.node = node_of(source, settings, parameter_file)
        self._node_id = settings.node_id
        import_interface(settings.interface)
        address = CanAddress(
            interface=settings.interface, channel=settings.channel, host=settings.host, port=settings.port
        )
        self.bus = CanConnection(address, self._on_frame)
        #: Last frames by identifier and direction. The direction is True for frames that the node sent.
        self.last_frames: defaultdict[tuple[int, bool], LastFrame] = defaultdict(LastFrame)
        self._received = ReceiveQueue(self.node.is_vent)
        self._duplicate_id_frames = 0
        self._errors = 0
        self._warn = RateLimitedLogger(log, LOG_PERIOD_S).warning
        self._counter_logger = CounterLogger()
        self._source = source
        self._loop = asyncio.get_running_loop()

    async def open(self, stop: asyncio.Event) -> None:
        """Open the bus and check for 1.2 s, or until `stop` is set, that the node id is free.

        If a stored node id is in use, the node uses the node id of the configuration instead. Raises
        ServerError if the bus cannot be opened or the node id of the configuration is in use.
        """
        try:
            try:
                await self._open_bus(stop)
            except NodeIdInUseError as error:
                if not isinstance(self.node, CanopenNode) or self.node.options.node_id == self._node_id:
                    raise
                log.warning("stored CANopen node id is not used: %s", error)
                self.node.storage.problem = f"another node has the node id {self.node.options.node_id}"
                self.node.use_node_id(self._node_id)
                await self._open_bus(stop)
        except OSError as error:
            raise ServerError(str(error)) from None

    async def _open_bus(self, stop: asyncio.Event) -> None:
        await cancel_on(stop, run_in_background(partial(self.bus.open, self.node.transmit_ids)))

    def on_sample(self, now_s: float) -> None:
        """Send the frames that are due because of a new sample."""
        self._send(self.node.on_sample(now_s), now_s)

    def tick(self, now_s: float) -> None:
        """Send the frames that are due by time, and report the state of the bus to the source."""
        self._source.can_down = not self.bus.is_up
        self._send(self.node.tick(now_s), now_s)
        if line := self._counter_logger.line(self._counts(), now_s):
            log.warning("CAN: %s", line)

    def _counts(self) -> dict[str, int]:
        counters = self.bus.counters
        return {
            **{f"frames not sent ({cause.value})": number for cause, number in self.bus.drops.items()},
            "error frames": counters.error_frames,
            "ignored frames with our identifiers": self.node.counters.ignored,
            "frames dropped because of a flood": self._received.dropped,
            "internal errors": counters.errors + self._errors,
            f"frames of another node with our id {self.node.options.node_id}": self._duplicate_id_frames,
        }

    def close(self) -> None:
        """Close the bus."""
        self.bus.close()

    def _on_frame(self, frame: CanFrame) -> None:
        """Queue a received frame. Runs in the thread of the bus."""
        if self.node.accepts(frame) and self._received.put(frame):
            self._loop.call_soon_threadsafe(self._handle_one)

    def _handle_one(self) -> None:
        frame = self._received.get()
        self._duplicate_id_frames += frame.id in self.node.transmit_ids and not frame.kind
        now_s = time.monotonic()
        self.last_frames[frame.id, False].update(frame.data, now_s)
        try:
            self._send(self.node.receive(frame, now_s), now_s)
        except Exception:
            self._errors += 1
            self._warn(now_s, "CAN frame %03Xh dropped after an internal error", frame.id, exc_info=True)

    def _send(self, frames: list[CanFrame], now_s: float) -> None:
        for frame in frames:
            self.bus.send(frame, now_s)
            self.last_frames[frame.id, True].update(frame.data, now_s)
