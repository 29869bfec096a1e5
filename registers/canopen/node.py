"""The CANopen slave without I/O: frames in, frames out, time an argument; the same seam as the raw node."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from registers.can.command import CAN, MALFORMED, CommandDesk, Reply, vents
from registers.can.frames import (
    ANSWER,
    COMMAND,
    EMERGENCY,
    FORCE,
    HEARTBEAT,
    SDO_ANSWER,
    Frame,
    encode,
    sent_ids,
)
from registers.can.node import Counters
from registers.can.options import Options
from registers.can.wire import CanFrame
from registers.canopen import nmt
from registers.canopen.communication import (
    EMERGENCY_INHIBIT,
    ERROR_FIELD,
    MASTER,
    OFF,
    ON_ERROR,
    PRODUCER,
    RPDO_COB_ID,
    TPDOS,
)
from registers.canopen.emergency import Emergencies
from registers.canopen.heartbeat import Consumer, Producer, watched
from registers.canopen.nmt import Service
from registers.canopen.occasions import Occasions
from registers.canopen.parameters import Parameters
from registers.canopen.pdo import Tpdo
from registers.canopen.readings import Identity, Told, readings
from registers.canopen.sdo import SdoServer
from registers.canopen.store import Store
from registers.source import Source

SYNC_ID = 0x080
SDO_REQUEST = 0x600
_BOOT_UP = b"\x00"  #: which is no heartbeat: a master that starts over and over watches nothing


class CanopenNode:
    """One source as a slave. No NMT command moves a valve; leases and the watch over the master do."""

    def __init__(self, source: Source, options: Options, identity: Identity) -> None:
        self.options = options
        self.counters = Counters()
        self.own_ids = sent_ids(options.node_id)
        self._source = source
        self._parameters = Parameters(options)
        self._desk = CommandDesk(source)
        self._occasions = Occasions(options.force_rate_hz)
        self._master = Consumer()
        self._beat = Producer()
        self._told = Told()
        self._emergencies = Emergencies()
        self._tpdos = {
            tpdo[0].name: Tpdo(number, tpdo[0], self._parameters) for number, tpdo in enumerate(TPDOS)
        }
        own = readings(identity, self._told, lambda: self._emergencies)
        self._store = Store(source, self._parameters, options.node_id, own)
        self._store.on_write = {
            ERROR_FIELD: lambda _: self._emergencies.history.clear(),
            MASTER: self._watch_anew,
            PRODUCER: self._begin_to_beat,
        }
        self._sdo = SdoServer(self._store)
        self._state = "boot_up"
        self._handlers: Mapping[int, Callable[[bytes, float], list[CanFrame] | None]] = {
            nmt.NMT_ID: self._manage,
            SYNC_ID: self._sync,
            SDO_REQUEST + options.node_id: self._serve,
            COMMAND.base_id + options.node_id: self._command,
        }

    # ---- to the bus

    def on_sample(self, now_s: float) -> list[CanFrame]:
        """Frames due at a new sample."""
        snapshot = self._source.snapshot(CAN, now_s)
        self._note(self._occasions.at_sample(snapshot))
        return self._errors(snapshot, now_s) + self._due(snapshot, now_s)

    def tick(self, now_s: float) -> list[CanFrame]:
        """Frames due by time alone; to be called every 10 ms, with samples or without."""
        snapshot = self._source.snapshot(CAN, now_s)
        frames = self._boot(now_s) if self._state == "boot_up" else []
        if self._master.ran_out(now_s):
            self._lose_master(now_s)
            snapshot = self._source.snapshot(CAN, now_s)
        if self._beat.due(now_s, self._parameters[PRODUCER] / 1e3):
            frames.append(self._frame(HEARTBEAT, None, node_state=self._state))
        self._note(self._occasions.at_tick(snapshot, now_s))
        self._answer(self._desk.ended(snapshot))
        given_up = self._sdo.tick(now_s)
        if given_up and self._admits(Service.SDO):
            frames.append(self._sdo_frame(given_up))
        return frames + self._errors(snapshot, now_s) + self._due(snapshot, now_s)

    def _boot(self, now_s: float) -> list[CanFrame]:
        self._state = nmt.PRE_OPERATIONAL
        self._begin_to_beat(now_s)
        return [self._frame(HEARTBEAT, None, node_state="boot_up")]

    def _begin_to_beat(self, now_s: float) -> None:
        self._beat.begin(now_s, self._parameters[PRODUCER] / 1e3)

    def _admits(self, service: Service) -> bool:
        return service in nmt.ADMITTED.get(self._state, ())

    def _note(self, events: set[str]) -> None:
        for name in events:
            self._tpdos[name].event()

    def _due(self, snapshot: Any, now_s: float) -> list[CanFrame]:
        if not self._admits(Service.PDO):
            return []
        return [self._pdo(tpdo.frame, snapshot) for tpdo in self._tpdos.values() if tpdo.due(now_s)]

    def _pdo(self, frame: Frame, snapshot: Any) -> CanFrame:
        if frame is FORCE:
            self._told.counter = (self._told.counter + 1) & 0xFF
        return self._frame(frame, snapshot, **self._told.own(frame))

    def _errors(self, snapshot: Any, now_s: float) -> list[CanFrame]:
        self._emergencies.follow(snapshot, master_lost=self._master.lost)
        if not self._admits(Service.EMERGENCY):
            return []
        due = self._emergencies.due(now_s, self._parameters[EMERGENCY_INHIBIT] / 1e4)
        return [CanFrame(EMERGENCY.base_id + self.options.node_id, data) for data in due]

    def _lose_master(self, now_s: float) -> None:
        self._source.master_lost(now_s)
        if self._state == nmt.OPERATIONAL:
            self._enter(nmt.ON_ERROR.get(self._parameters[ON_ERROR], self._state))

    def _frame(self, frame: Frame, snapshot: Any, **own: Any) -> CanFrame:
        return CanFrame(frame.base_id + self.options.node_id, encode(frame, snapshot, **own))

    def _sdo_frame(self, data: bytes) -> CanFrame:
        return CanFrame(SDO_ANSWER + self.options.node_id, data)

    # ---- from the bus

    def hears(self, frame: CanFrame) -> bool:
        """Whether a frame concerns this node at all; the rest of the bus's traffic does not."""
        return frame.id in self._handlers or frame.id in self.own_ids or frame.id == self._master_id

    @property
    def _master_id(self) -> int | None:
        node_id, _ = watched(self._parameters[MASTER])
        return HEARTBEAT.base_id + node_id if node_id else None

    def is_vent(self, frame: CanFrame) -> bool:
        """Whether a frame asks for a vent that this node carries out now: a Command, or SDO in one frame."""
        if frame.kind:
            return False
        if frame.id == COMMAND.base_id + self.options.node_id:
            return vents(frame.data)
        by_sdo = frame.id == SDO_REQUEST + self.options.node_id and self._admits(Service.SDO)
        return by_sdo and self._sdo.vents(frame.data)

    def receive(self, frame: CanFrame, now_s: float) -> list[CanFrame]:
        """Frames that answer one received; only data frames with an 11-bit identifier are obeyed."""
        if not self.hears(frame):
            return []
        handler = self._handlers.get(frame.id)
        if handler is None and frame.id == self._master_id and len(frame.data) == 1:
            handler = self._watch
        frames = handler(frame.data, now_s) if handler and not frame.kind else None
        if frames is None:
            self.counters.ignored += 1
        return frames or []

    # Each of these gives the answer, or None where it did not obey.

    def _manage(self, data: bytes, now_s: float) -> list[CanFrame] | None:
        if nmt.is_for_another(data, self.options.node_id):
            return []
        command = nmt.command_for(data, self.options.node_id)
        if command in nmt.RESETS:
            self._parameters.reset()
            self._emergencies = Emergencies()
            self._sdo = SdoServer(self._store)
            return self._boot(now_s)
        if command is None or self._state == "boot_up":
            return None
        self._enter(nmt.COMMANDS[command])
        return []

    def _enter(self, state: str) -> None:
        if state == nmt.OPERATIONAL != self._state:
            for tpdo in self._tpdos.values():
                tpdo.begin()
        self._state = state

    def _sync(self, data: bytes, now_s: float) -> list[CanFrame] | None:
        if len(data) > 1:
            return None
        if not self._admits(Service.PDO):
            return []
        snapshot = self._source.snapshot(CAN, now_s)
        return [self._pdo(tpdo.frame, snapshot) for tpdo in self._tpdos.values() if tpdo.due_at_sync()]

    def _serve(self, data: bytes, now_s: float) -> list[CanFrame] | None:
        answer = self._sdo.take(data, now_s) if self._admits(Service.SDO) else None
        if answer is None:
            return None
        return [self._sdo_frame(answer)] if answer else []

    def _watch(self, data: bytes, now_s: float) -> list[CanFrame]:
        if data != _BOOT_UP:
            self._end_loss(now_s)
            self._master.heard(now_s, watched(self._parameters[MASTER])[1])
        return []

    def _watch_anew(self, now_s: float) -> None:
        self._end_loss(now_s)
        self._master.begin()

    def _end_loss(self, now_s: float) -> None:
        if self._master.lost:
            self._source.master_back(now_s)

    def _command(self, data: bytes, now_s: float) -> list[CanFrame] | None:
        """A Command is taken in Operational; one that vents is taken in every state."""
        self.counters.commands += 1
        listening = self._admits(Service.PDO) and not self._parameters[RPDO_COB_ID] & OFF
        if not listening and not vents(data):
            return None
        self._told.command = data if len(data) == COMMAND.length else self._told.command
        reply = self._desk.take(data, now_s)
        if reply and reply.result in MALFORMED:
            self._source.refused(CAN, data, reply.result, now_s)
        self._answer(reply)
        return self._due(self._source.snapshot(CAN, now_s), now_s)

    def _answer(self, reply: Reply | None) -> None:
        if reply is not None:
            self._told.reply = reply
            self._tpdos[ANSWER.name].event()
