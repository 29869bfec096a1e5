"""Receiver of the CAN frames of one instrument, which combines them to a measurement."""

from __future__ import annotations

import math
import threading
import time
from dataclasses import replace
from typing import Any

from pneuforce.client.latest_sample import LatestSample
from pneuforce.client.measurement import Measurement, State, Status, number_or_none, state_of, status_of
from pneuforce.registers.can.frames import (
    ANSWER,
    COMMAND,
    EMERGENCY,
    FORCE,
    HEARTBEAT,
    IDENTITY,
    RIG_ERROR,
    STATE,
    STATUS_FRAME,
    decode_frame,
)
from pneuforce.registers.can.wire import CanFrame
from pneuforce.registers.codes import CONDENSED, FAULTS, STATUS

#: Conditions that the Force frame contains, too. The Force frame is newer than the Status frame.
_IN_FORCE_FRAME = status_of({bit.name for bit in CONDENSED.bits} & {bit.name for bit in STATUS.bits})
_NEEDED = {frame.name for frame in (FORCE, STATE, STATUS_FRAME, IDENTITY)}


class CanReceiver:
    """Latest frames of one node. `receive` is called by the thread of the bus, all else by other threads."""

    def __init__(self, node_id: int, silence_s: float) -> None:
        self.first_out_fault = 0  #: code of the first fault since the faults were cleared; 0 if unknown
        self.vented_by_another_node = False  #: since the last vent of this program
        self._node_id = node_id
        self._silence_s = silence_s
        self._changed = threading.Condition()
        self._frames: dict[str, dict[str, Any]] = {}
        self._force_s = self._received_s = -math.inf
        self._counter = 0  #: number of Force frames since the first, including lost frames
        self._answers: dict[int, str] = {}
        self._slots: tuple[LatestSample, ...] = ()
        self._closed = False

    # ---- called by the thread of the bus

    def receive(self, can_frame: CanFrame, *, may_be_old: bool = False) -> None:
        """Store a frame of the node. Frames of other nodes are ignored.

        A force that `may_be_old`, because its frame possibly waited in a buffer, is never valid.
        """
        decoded = decode_frame(can_frame, self._node_id)
        if decoded is None:
            return
        frame, values = decoded
        with self._changed:
            if frame is COMMAND:  # sent by another node: own frames are not received
                self.vented_by_another_node |= values["mode"] == "vent"
                return
            self._received_s = time.monotonic()
            is_new = frame is not FORCE or self._count(values["counter"])
            if frame is FORCE and is_new:
                self._force_s = -math.inf if may_be_old else self._received_s
            if is_new:
                self._frames[frame.name] = values
            self._store_event(frame.name, values)
            self._changed.notify_all()
            slots = self._slots if frame in (FORCE, STATUS_FRAME) and self._frames.keys() >= _NEEDED else ()
        for slot in slots:
            slot.put(self.measurement())

    def _count(self, counter: int) -> bool:
        """Count a Force frame. Return False if the frame was repeated, for example by a gateway."""
        before = self._frames.get(FORCE.name)
        step = (counter - before["counter"]) & 0xFF if before else 1
        self._counter += step
        return step != 0

    def _store_event(self, name: str, values: dict[str, Any]) -> None:
        if name == ANSWER.name:
            self._answers[values["sequence"]] = values["result"]
        elif name == EMERGENCY.name:
            fault = values["error_code"] - RIG_ERROR
            if not values["active_fault_count"]:
                self.first_out_fault = 0
            elif fault in FAULTS.names and not self.first_out_fault:
                self.first_out_fault = fault
        elif name == HEARTBEAT.name and values["node_state"] == "boot_up":
            self.vented_by_another_node = True  # the instrument was restarted, and its rig is vented

    # ---- called by other threads

    def silent_s(self) -> float:
        """Return the time since the last frame of the node [s]."""
        return time.monotonic() - self._received_s

    def wait_for_frame(self, timeout_s: float) -> bool:
        """Wait for the next frame of the node. Return False if none arrives within `timeout_s`."""
        with self._changed:
            before_s = self._received_s
            return self._changed.wait_for(lambda: self._received_s > before_s, timeout_s)

    def measurement(self) -> Measurement:
        """Return the latest values. The force is valid only if its frame is not older than `silence_s`."""
        with self._changed:
            force, status, state = (self._frames[f.name] for f in (FORCE, STATUS_FRAME, STATE))
            age_s, counter = time.monotonic() - self._force_s, self._counter
        condensed = status_of(force["condensed_status"]) & _IN_FORCE_FRAME
        measurement = Measurement(
            pressure_kpa=number_or_none(force["pressure"]),
            radius_mm=number_or_none(state["radius"]),
            setpoint_kpa=number_or_none(state["setpoint"]),
            state=state_of(status["state"]),
            status_or_none=(status_of(status["status"]) - _IN_FORCE_FRAME) | condensed,
            sample_counter=counter,
            age_s=number_or_none(age_s),
        )
        if "stale_or_lost" in force["condensed_status"] or not age_s <= self._silence_s:
            return replace(
                measurement,
                pressure_kpa=None,
                status_or_none=measurement.status | {Status.STALE},
                sample_counter=None,
            )
        is_valid = "force_valid" in force["condensed_status"] and measurement.state is not State.TRIPPED
        if not is_valid or not math.isfinite(force["force"]):
            return measurement
        return replace(measurement, force_or_nan=force["force"], force_std_or_nan=force["force_uncertainty"])

    def wait_for_identity(self, timeout_s: float) -> int | None:
        """Return the map hash as soon as all periodic frames have arrived, None if they do not arrive."""
        with self._changed:
            if not self._changed.wait_for(lambda: self._frames.keys() >= _NEEDED, timeout_s):
                return None
            return int(self._frames[IDENTITY.name]["map_hash"])

    def identity(self) -> dict[str, Any]:
        """Return the values of the latest frame Identity."""
        with self._changed:
            return self._frames[IDENTITY.name]

    def expect(self, sequence: int, is_vent: bool) -> None:
        """Forget an earlier Answer with this sequence number. Before a vent, also forget vents of others."""
        with self._changed:
            self._answers.pop(sequence, None)
            self.vented_by_another_node = self.vented_by_another_node and not is_vent

    def wait_for_answer(self, sequence: int, timeout_s: float) -> str | None:
        """Return the result of the Command with this sequence number, None if no Answer arrives in time."""
        with self._changed:
            self._changed.wait_for(lambda: sequence in self._answers or self._closed, timeout_s)
            return self._answers.get(sequence)

    def add(self, slot: LatestSample) -> None:
        """Put each new measurement into `slot`."""
        with self._changed:
            self._slots = (*self._slots, slot)

    def remove(self, slot: LatestSample) -> None:
        """Put no more measurements into `slot`."""
        with self._changed:
            self._slots = tuple(each for each in self._slots if each is not slot)

    def close(self) -> None:
        """End all waits."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
