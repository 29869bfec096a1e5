"""CANopen node (NMT slave) without I/O, with the same interface as the node in raw mode.

Received frames and the time are arguments of the methods. The methods return the frames to send.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from dataclasses import replace
from typing import Any

from pneuforce.registers.can.command import CAN_PEER, CommandHandler, is_vent_command
from pneuforce.registers.can.frames import (
    COMMAND,
    EMERGENCY,
    HEARTBEAT,
    MASTER_LOST,
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
from pneuforce.registers.canopen.emergency import EmergencyProducer, length_errors
from pneuforce.registers.canopen.heartbeat import HeartbeatConsumer, HeartbeatProducer
from pneuforce.registers.canopen.lss import LSS_REQUEST_ID, LSS_RESPONSE_ID, LssSlave
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
        self._source = source
        self._parameters = Parameters(options)
        self._command_handler = CommandHandler(source)
        self._triggers = PdoTriggers(options.force_rate_hz)
        self._heartbeat_consumer = HeartbeatConsumer(source)
        self._heartbeat_producer = HeartbeatProducer()
        self._last_frames = LastFrames()
        self._emergencies = EmergencyProducer()
        #: Error code of the last Command if its length was wrong.
        self._pdo_errors: frozenset[int] = frozenset()
        self._tpdos = TpdoProducer(source, self._parameters, self._last_frames)
        readers = value_readers(identity, self._last_frames, lambda: self._emergencies, self.storage)
        self._store = ObjectStore(source, self._parameters, readers)
        self._store.actions = {
            ERROR_FIELD: lambda _: self._emergencies.history.clear(),
            **storage_actions(self.storage, self._parameters),
        }
        self._store.on_write = {
            CONSUMER_HEARTBEAT: lambda now_s: self._heartbeat_consumer.configure(
                self._parameters[CONSUMER_HEARTBEAT], now_s
            ),
            PRODUCER_HEARTBEAT: self._start_heartbeat_producer,
        }
        self._sdo_server = SdoServer(self._store)
        self._lss = LssSlave(source, options.bit_rate, self.storage)
        self._state = "boot_up"
        self._discrete_state: Hashable = None
        self.use_node_id(self.storage.stored.node_id or options.node_id)

    def use_node_id(self, node_id: int) -> None:
        """Use another node id, and restore the stored or default parameters."""
        self.options = replace(self.options, node_id=node_id)
        self.transmit_ids = transmit_ids(node_id)
        self._handlers: Mapping[int, Callable[[bytes, float], list[CanFrame] | None]] = {
            nmt.NMT_ID: self._on_nmt,
            SYNC_ID: self._on_sync,
            LSS_REQUEST_ID: self._on_lss,
            SDO_REQUEST + node_id: self._on_sdo,
            COMMAND.base_id + node_id: self._on_command,
        }
        self._lss.use_node_id(node_id)
        try:
            self._parameters.reset(self.options, self.storage.stored.values)
        except ValueError as error:
            self.storage.reject_values(str(error))
        self._heartbeat_consumer.reset(self._parameters[CONSUMER_HEARTBEAT])

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
            self._on_master_lost()
            snapshot = self._source.snapshot(CAN_PEER, now_s)
        if self._heartbeat_producer.due(now_s, self._parameters[PRODUCER_HEARTBEAT] / 1e3):
            frames.append(self._frame(HEARTBEAT, None, node_state=self._state))
        self._tpdos.trigger(self._triggers.at_tick(snapshot, now_s))
        self._tpdos.answer(self._command_handler.finished_result(snapshot))
        self.storage.tick()
        response = self._sdo_server.tick(now_s)
        if response and self._allows(CommunicationObject.SDO):
            frames.append(self._sdo_frame(response))
        if response := self._lss.tick():
            frames.append(CanFrame(LSS_RESPONSE_ID, response))
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

    def _on_master_lost(self) -> None:
        if self._state == nmt.OPERATIONAL:
            self._enter(nmt.STATE_AFTER_ERROR.get(self._parameters[ERROR_BEHAVIOUR], self._state))

    def _frame(self, frame: FrameDefinition, snapshot: Any, **node_values: Any) -> CanFrame:
        return CanFrame(frame.base_id + self.options.node_id, encode(frame, snapshot, **node_values))

    def _sdo_frame(self, data: bytes) -> CanFrame:
        return CanFrame(SDO_RESPONSE + self.options.node_id, data)

    # ---- receiving

    def accepts(self, frame: CanFrame) -> bool:
        """Return True if `receive` must be called for a frame. Other traffic on the bus can be skipped."""
        known = frame.id in self._handlers or frame.id in self.transmit_ids
        return known or self._heartbeat_consumer.accepts(frame.id)

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
        frames = None
        if handler and not frame.kind:
            frames = handler(frame.data, now_s)
        elif self._heartbeat_consumer.accepts(frame.id) and not frame.kind:
            frames = [] if self._heartbeat_consumer.received(frame, now_s) else None
        if frames is None:
            self.counters.ignored += 1
        return frames or []

    # Each handler returns the answer, or None if it ignored the frame.

    def _on_nmt(self, data: bytes, now_s: float) -> list[CanFrame] | None:
        if nmt.is_for_another_node(data, self.options.node_id):
            return []
        command = nmt.command_for(data, self.options.node_id)
        if command in nmt.RESET_COMMANDS:
            self.use_node_id(self._node_id_after_reset(now_s))
            self._emergencies = EmergencyProducer()
            self._pdo_errors = frozenset()
            self._sdo_server = SdoServer(self._store)
            return self._boot(now_s)
        if command is None or self._state == "boot_up":
            return None
        self._enter(nmt.STATE_AFTER_COMMAND[command])
        return []

    def _node_id_after_reset(self, now_s: float) -> int:
        """Return the node id that LSS has configured, but keep the present one while the balloon is inflated.

        The other nodes send their vents to the present node id.
        """
        snapshot = self._source.snapshot(CAN_PEER, now_s)
        # At the beginning of an inflation, the mode is already "hold", but the pressure is still low.
        stays_vented = snapshot.mode == "vent" and "vented" in snapshot.status
        return self._lss.pending_node_id if stays_vented else self.options.node_id

    def _on_lss(self, data: bytes, now_s: float) -> list[CanFrame] | None:
        response = self._lss.handle(data, now_s)
        if response is None:
            return None
        return [CanFrame(LSS_RESPONSE_ID, response)] if response else []

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
        self._pdo_errors = length_errors(data)
        result = self._command_handler.handle(data, now_s)
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
