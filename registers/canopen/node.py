"""CANopen node (NMT slave) without I/O, with the same interface as the node in raw mode.

Received frames and the time are arguments of the methods. The methods return the frames to send.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from functools import partial
from typing import Any

from pneuforce.registers.can.command import CAN_PEER, MALFORMED, CommandHandler, is_vent_command
from pneuforce.registers.can.frames import (
    COMMAND,
    EMERGENCY,
    HEARTBEAT,
    MASTER_LOST,
    PDO_TOO_LONG,
    PDO_TOO_SHORT,
    SDO_RESPONSE,
    STORED_PARAMETERS,
    FrameDefinition,
    encode,
    transmit_ids,
)
from pneuforce.registers.can.node import NodeCounters
from pneuforce.registers.can.options import CanOptions
from pneuforce.registers.can.rejected_command import rejected_command
from pneuforce.registers.can.wire import CanFrame
from pneuforce.registers.canopen import nmt
from pneuforce.registers.canopen.communication import (
    CONSUMER_HEARTBEAT,
    EMERGENCY_INHIBIT,
    ERROR_BEHAVIOUR,
    ERROR_FIELD,
    PDO_DISABLED,
    PRODUCER_HEARTBEAT,
    RPDO_COB_ID,
)
from pneuforce.registers.canopen.emergency import EmergencyProducer
from pneuforce.registers.canopen.heartbeat import HeartbeatConsumer, HeartbeatProducer
from pneuforce.registers.canopen.nmt import CommunicationObject
from pneuforce.registers.canopen.node_values import CanopenIdentity, LastFrames, value_readers
from pneuforce.registers.canopen.object_store import ObjectStore
from pneuforce.registers.canopen.parameter_storage import ParameterStorage
from pneuforce.registers.canopen.parameters import Parameters
from pneuforce.registers.canopen.pdo_triggers import PdoTriggers
from pneuforce.registers.canopen.sdo import SdoServer
from pneuforce.registers.canopen.storage_objects import storage_actions
from pneuforce.registers.canopen.tpdo_producer import TpdoProducer
from pneuforce.registers.source import Source

SYNC_ID = 0x080
SDO_REQUEST = 0x600
#: Data of a boot-up message. A boot-up message of the master is not counted as a heartbeat: a master that
#: sends only boot-up messages restarts repeatedly and does not monitor the instrument.
_BOOT_UP = b"\x00"


class CanopenNode:
    """CANopen node of one source.

    No NMT command moves a valve. An expired lease or a lost heartbeat of the master can vent the balloon.
    """

    def __init__(
        self,
        source: Source,
        options: CanOptions,
        identity: CanopenIdentity,
        storage: ParameterStorage | None = None,
    ) -> None:
        """Create the node. Without a `storage`, a master cannot store parameters."""
        self.storage = storage or ParameterStorage()
        self.options = options
        self.counters = NodeCounters()
        self.transmit_ids = transmit_ids(options.node_id)
        self._source = source
        self._parameters = Parameters(options)
        self._command_handler = CommandHandler(source)
        self._triggers = PdoTriggers(options.force_rate_hz)
        self._heartbeat_consumer = HeartbeatConsumer()
        self._heartbeat_producer = HeartbeatProducer()
        self._last_frames = LastFrames()
        self._emergencies = EmergencyProducer()
        self._pdo_errors: frozenset[int] = (
            frozenset()
        )  #: error code of the last Command, if its length is wrong
        self._tpdos = TpdoProducer(source, self._parameters, self._last_frames)
        readers = value_readers(identity, self._last_frames, lambda: self._emergencies, self.storage)
        self._store = ObjectStore(source, self._parameters, readers)
        self._store.actions = {
            ERROR_FIELD: lambda _: self._emergencies.history.clear(),
            **storage_actions(self.storage, self._parameters),
        }
        self._store.on_write = {
            CONSUMER_HEARTBEAT: self._configure_heartbeat_consumer,
            PRODUCER_HEARTBEAT: self._start_heartbeat_producer,
        }
        self._sdo_server = SdoServer(self._store)
        self._restore_parameters()
        self._state = "boot_up"
        self._discrete_state: Hashable = None
        self._handlers: Mapping[int, Callable[[bytes, float], list[CanFrame] | None]] = {
            nmt.NMT_ID: self._on_nmt,
            SYNC_ID: self._on_sync,
            SDO_REQUEST + options.node_id: self._on_sdo,
            COMMAND.base_id + options.node_id: self._on_command,
        }

    # ---- sending

    def on_sample(self, now_s: float) -> list[CanFrame]:
        """Return the frames due at a new sample."""
        force_due = self._triggers.force_due(alarm=self._source.force_limit_exceeded)
        before, self._discrete_state = self._discrete_state, self._source.discrete_state
        frames = []
        if force_due or self._discrete_state != before or self._emergencies.pending:
            snapshot = self._source.snapshot(CAN_PEER, now_s)
            self._tpdos.trigger(self._triggers.at_sample(snapshot, force_due=force_due))
            frames = self._emergency_frames(snapshot, now_s)
        return frames + self._due_tpdos(now_s)

    def tick(self, now_s: float) -> list[CanFrame]:
        """Return the frames that are due at this time. Call this method every 10 ms, even without samples."""
        snapshot = self._source.snapshot(CAN_PEER, now_s)
        frames = self._boot(now_s) if self._state == "boot_up" else []
        if self._heartbeat_consumer.timed_out(now_s):
            self._on_master_lost(now_s)
            snapshot = self._source.snapshot(CAN_PEER, now_s)
        if self._heartbeat_producer.due(now_s, self._parameters[PRODUCER_HEARTBEAT] / 1e3):
            frames.append(self._frame(HEARTBEAT, None, node_state=self._state))
        self._tpdos.trigger(self._triggers.at_tick(snapshot, now_s))
        self._tpdos.answer(self._command_handler.finished_result(snapshot))
        self.storage.tick()
        response = self._sdo_server.tick(now_s)
        if response and self._allows(CommunicationObject.SDO):
            frames.append(self._sdo_frame(response))
        return frames + self._emergency_frames(snapshot, now_s) + self._due_tpdos(now_s)

    def _boot(self, now_s: float) -> list[CanFrame]:
        self._state = nmt.PRE_OPERATIONAL
        self._start_heartbeat_producer(now_s)
        return [self._frame(HEARTBEAT, None, node_state="boot_up")]

    def _start_heartbeat_producer(self, now_s: float) -> None:
        self._heartbeat_producer.start(now_s, self._parameters[PRODUCER_HEARTBEAT] / 1e3)

    def _allows(self, communication_object: CommunicationObject) -> bool:
        return communication_object in nmt.ALLOWED_OBJECTS.get(self._state, ())

    def _due_tpdos(self, now_s: float) -> list[CanFrame]:
        return self._tpdos.due(now_s) if self._allows(CommunicationObject.PDO) else []

    def _emergency_frames(self, snapshot: Any, now_s: float) -> list[CanFrame]:
        present = {MASTER_LOST: self._heartbeat_consumer.lost, STORED_PARAMETERS: bool(self.storage.problem)}
        errors = {code for code, is_present in present.items() if is_present}
        self._emergencies.update(snapshot, self._pdo_errors.union(errors))
        if not self._allows(CommunicationObject.EMERGENCY):
            return []
        due = self._emergencies.due(now_s, self._parameters[EMERGENCY_INHIBIT] / 1e4)
        return [CanFrame(EMERGENCY.base_id + self.options.node_id, data) for data in due]

    def _on_master_lost(self, now_s: float) -> None:
        self._source.master_lost(now_s)
        if self._state == nmt.OPERATIONAL:
            self._enter(nmt.STATE_AFTER_ERROR.get(self._parameters[ERROR_BEHAVIOUR], self._state))

    def _frame(self, frame: FrameDefinition, snapshot: Any, **node_values: Any) -> CanFrame:
        return CanFrame(frame.base_id + self.options.node_id, encode(frame, snapshot, **node_values))

    def _sdo_frame(self, data: bytes) -> CanFrame:
        return CanFrame(SDO_RESPONSE + self.options.node_id, data)

    # ---- receiving

    def accepts(self, frame: CanFrame) -> bool:
        """Return True if `receive` must be called for a frame. Other traffic on the bus can be skipped."""
        return frame.id in self._handlers or frame.id in self.transmit_ids or bool(self._master_of(frame))

    def _master_of(self, frame: CanFrame) -> int:
        """Return the node id of the monitored master that sent this heartbeat; 0 for any other frame."""
        node_id = frame.id - HEARTBEAT.base_id
        return node_id if node_id in self._heartbeat_consumer.node_ids else 0

    def is_vent(self, frame: CanFrame) -> bool:
        """Return True if a Command or an expedited SDO requests a vent that this node carries out now."""
        if frame.kind:
            return False
        if frame.id == COMMAND.base_id + self.options.node_id:
            return is_vent_command(frame.data)
        is_sdo = frame.id == SDO_REQUEST + self.options.node_id and self._allows(CommunicationObject.SDO)
        return is_sdo and self._sdo_server.is_vent(frame.data)

    def receive(self, frame: CanFrame, now_s: float) -> list[CanFrame]:
        """Handle a received frame and return the frames that answer it.

        The node acts only on data frames with an 11-bit identifier.
        """
        if not self.accepts(frame):
            return []
        handler = self._handlers.get(frame.id)
        if handler is None and len(frame.data) == 1 and (master := self._master_of(frame)):
            handler = partial(self._on_master_heartbeat, master)
        frames = handler(frame.data, now_s) if handler and not frame.kind else None
        if frames is None:
            self.counters.ignored += 1
        return frames or []

    # Each handler returns the answer, or None if it ignored the frame.

    def _on_nmt(self, data: bytes, now_s: float) -> list[CanFrame] | None:
        if nmt.is_for_another_node(data, self.options.node_id):
            return []
        command = nmt.command_for(data, self.options.node_id)
        if command in nmt.RESET_COMMANDS:
            self._restore_parameters()
            self._emergencies = EmergencyProducer()
            self._pdo_errors = frozenset()
            self._sdo_server = SdoServer(self._store)
            return self._boot(now_s)
        if command is None or self._state == "boot_up":
            return None
        self._enter(nmt.STATE_AFTER_COMMAND[command])
        return []

    def _restore_parameters(self) -> None:
        try:
            self._parameters.reset(self.options, self.storage.stored.values)
        except ValueError as error:
            self.storage.reject_values(str(error))
        self._heartbeat_consumer.reset(self._parameters[CONSUMER_HEARTBEAT])

    def _enter(self, state: str) -> None:
        if state == nmt.OPERATIONAL != self._state:
            self._tpdos.start()
        self._state = state

    def _on_sync(self, data: bytes, now_s: float) -> list[CanFrame] | None:
        if len(data) > 1:
            return None
        return self._tpdos.due_at_sync(now_s) if self._allows(CommunicationObject.PDO) else []

    def _on_sdo(self, data: bytes, now_s: float) -> list[CanFrame] | None:
        allowed = self._allows(CommunicationObject.SDO)
        response = self._sdo_server.handle(data, now_s) if allowed else None
        if response is None:
            return None
        return [self._sdo_frame(response)] if response else []

    def _on_master_heartbeat(self, master: int, data: bytes, now_s: float) -> list[CanFrame]:
        if data != _BOOT_UP:
            self._on_master_recovered(now_s)
            self._heartbeat_consumer.received(master, now_s)
        return []

    def _configure_heartbeat_consumer(self, now_s: float) -> None:
        self._on_master_recovered(now_s)
        self._heartbeat_consumer.configure(self._parameters[CONSUMER_HEARTBEAT])

    def _on_master_recovered(self, now_s: float) -> None:
        if self._heartbeat_consumer.lost:
            self._source.master_recovered(now_s)

    def _on_command(self, data: bytes, now_s: float) -> list[CanFrame] | None:
        """Handle a Command. A vent is carried out in every state; any other mode requires Operational."""
        self.counters.commands += 1
        rpdo_enabled = not self._parameters[RPDO_COB_ID] & PDO_DISABLED
        enabled = self._allows(CommunicationObject.PDO) and rpdo_enabled
        if not enabled and not is_vent_command(data):
            self._log_disabled_command(data, now_s)
            return []
        if len(data) == COMMAND.length:
            self._last_frames.command = data
        self._pdo_errors = _length_error(data)
        result = self._command_handler.handle(data, now_s)
        if result and result.result in MALFORMED:
            self._source.log_rejected_write(CAN_PEER, rejected_command(data, result.result), now_s)
        self._tpdos.answer(result)
        snapshot = self._source.snapshot(CAN_PEER, now_s)
        return self._emergency_frames(snapshot, now_s) + self._due_tpdos(now_s)

    def _log_disabled_command(self, data: bytes, now_s: float) -> None:
        """Log a Command that the NMT state of the node, or a disabled RPDO1, does not allow."""
        reason, remedy = f"node_{self._state}", "start the node with NMT"
        if self._state == nmt.OPERATIONAL:
            reason, remedy = (
                "rpdo1_disabled",
                f"clear bit 31 of object {RPDO_COB_ID[0]:04X}h:{RPDO_COB_ID[1]}",
            )
        self._source.log_rejected_write(CAN_PEER, rejected_command(data, reason, remedy), now_s)


def _length_error(data: bytes) -> frozenset[int]:
    """Return the error code of a Command with a wrong length (CiA 301, 7.2.7.1); empty if it is right."""
    if len(data) == COMMAND.length:
        return frozenset()
    return frozenset((PDO_TOO_SHORT if len(data) < COMMAND.length else PDO_TOO_LONG,))
