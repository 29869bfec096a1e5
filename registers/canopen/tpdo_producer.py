"""Producer of all TPDOs of the node: collects the events, and encodes the frames that are due."""

from __future__ import annotations

from typing import Any

from pneuforce.registers.can.command import CAN_PEER, CommandResult
from pneuforce.registers.can.frames import ANSWER, FORCE, FrameDefinition, encode
from pneuforce.registers.can.wire import CanFrame
from pneuforce.registers.canopen.communication import TPDOS
from pneuforce.registers.canopen.node_values import LastFrames
from pneuforce.registers.canopen.parameters import Parameters
from pneuforce.registers.canopen.pdo import Tpdo
from pneuforce.registers.source import Source


class TpdoProducer:
    """TPDOs of one node. All frames of one call contain values of the same snapshot."""

    def __init__(self, source: Source, parameters: Parameters, last_frames: LastFrames) -> None:
        self._source = source
        self._parameters = parameters
        self._last_frames = last_frames
        self._tpdos = {tpdo[0].name: Tpdo(number, tpdo[0], parameters) for number, tpdo in enumerate(TPDOS)}

    def start(self) -> None:
        """Reset all TPDOs when the node enters Operational."""
        for tpdo in self._tpdos.values():
            tpdo.start()

    def trigger(self, frame_names: set[str]) -> None:
        """Record an event of each of these TPDOs."""
        for name in frame_names:
            self._tpdos[name].trigger()

    def answer(self, result: CommandResult | None) -> None:
        """Record the result of a Command and trigger Answer; None if no Command has finished."""
        if result is not None:
            self._last_frames.answer = result
            self.trigger({ANSWER.name})

    def due(self, now_s: float) -> list[CanFrame]:
        """Return the TPDOs that are due because of an event or an event timer."""
        return self._frames([tpdo.frame for tpdo in self._tpdos.values() if tpdo.due(now_s)], now_s)

    def due_at_sync(self, now_s: float) -> list[CanFrame]:
        """Return the TPDOs that are due at the SYNC that was just received, with the values at this time."""
        return self._frames([tpdo.frame for tpdo in self._tpdos.values() if tpdo.due_at_sync()], now_s)

    def _frames(self, due: list[FrameDefinition], now_s: float) -> list[CanFrame]:
        if not due:
            return []
        snapshot = self._source.snapshot(CAN_PEER, now_s)
        return [self._frame(frame, snapshot) for frame in due]

    def _frame(self, frame: FrameDefinition, snapshot: Any) -> CanFrame:
        if frame is FORCE:
            self._last_frames.counter = (self._last_frames.counter + 1) & 0xFF
        data = encode(frame, snapshot, **self._last_frames.node_values(frame))
        return CanFrame(frame.base_id + self._parameters.options.node_id, data)
