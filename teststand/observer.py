"""Observation of a running instrument over Modbus and CAN, and of the true values from the simulator."""

from __future__ import annotations

import contextlib
import json
import math
import socket
import time
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from threading import Event, Thread
from typing import Any

from pneuforce.registers.can.bus import CanAddress, listen
from pneuforce.registers.can.frames import decode_frame
from pneuforce.registers.modbus.client import ModbusClient, ModbusClientError

POLL_PERIOD_S = 0.05
HISTORY_S = 12.0
RECONNECT_TIMEOUT_S = 2.0
CAN_RETRY_S = 0.5
READ_TIMEOUT_S = 0.5
MAX_AGE_S = 0.5  #: older values of a source are not shown
_FAULTS = range(778, 794)  #: the first-out fault, and the latched faults


@dataclass(frozen=True, slots=True)
class CanNodeAddress:
    """Bus and node id of an instrument's CAN node."""

    bus: CanAddress
    node_id: int = 5


@dataclass(slots=True)
class EventRate:
    """Number of events in the last second."""

    times_s: deque[float] = field(default_factory=lambda: deque(maxlen=2000))
    count: int = 0

    def add(self, now_s: float) -> None:
        """Count one event at `now_s`."""
        self.times_s.append(now_s)
        self.count += 1

    def age_s(self, now_s: float) -> float:
        """Return the time since the last event, or infinity before the first event."""
        return now_s - self.times_s[-1] if self.times_s else math.inf

    def per_s(self, now_s: float) -> int:
        """Return the number of events in the second before `now_s`."""
        return sum(
            t_s > now_s - 1.0 for t_s in tuple(self.times_s)
        )  # a copy, because another thread adds events


@dataclass(slots=True)
class ObservedValues:
    """Latest values by name from three sources: Modbus registers, CAN frames, and truth of the simulator."""

    modbus: dict[str, Any] = field(default_factory=dict)
    can: dict[str, Any] = field(default_factory=dict)
    truth: dict[str, Any] = field(default_factory=dict)
    polls: EventRate = field(default_factory=EventRate)
    frames: EventRate = field(default_factory=EventRate)
    history: deque[tuple[float, float, float]] = field(
        default_factory=lambda: deque(maxlen=round(HISTORY_S / POLL_PERIOD_S))
    )  #: time [s], force [N] and pressure [kPa] of each poll

    def forget_old(self, now_s: float) -> None:
        """Remove the values of a source that has sent nothing for `MAX_AGE_S`."""
        if self.polls.age_s(now_s) > MAX_AGE_S:
            self.modbus = {}
        if self.frames.age_s(now_s) > MAX_AGE_S:
            self.can = {}


def can_frames(node: CanNodeAddress, stop: Event) -> Iterator[tuple[float, str, dict[str, Any]]]:
    """Yield time [s], name and values of each frame that the instrument sends."""
    for t_s, frame in listen(node.bus, stop):
        decoded = decode_frame(frame, node.node_id)
        if decoded is not None:
            definition, values = decoded
            yield t_s, definition.name, values


class Observer:
    """Threads that collect the values of a running instrument in `values` until they are stopped.

    Each thread connects again after its connection has failed.
    """

    def __init__(self, modbus_port: int, node: CanNodeAddress, control_port: int) -> None:
        self.values = ObservedValues()
        self._stop = Event()
        self._threads = [
            Thread(target=self._poll_modbus, args=(modbus_port,), daemon=True),
            Thread(target=self._receive_can, args=(node,), daemon=True),
            Thread(target=self._receive_truth, args=(control_port,), daemon=True),
        ]

    def start(self) -> None:
        """Start the threads."""
        for thread in self._threads:
            thread.start()

    def stop(self) -> None:
        """Stop the threads and wait for them for a short time."""
        self._stop.set()
        for thread in self._threads:
            thread.join(0.2)

    def _poll_modbus(self, port: int) -> None:
        while not self._stop.wait(POLL_PERIOD_S):
            with contextlib.suppress(ModbusClientError), ModbusClient.connect(port=port) as plc:
                while not self._stop.wait(POLL_PERIOD_S):
                    self._add(_read(plc), time.monotonic())
            self.values.modbus = {}

    def _add(self, values: dict[str, Any], now_s: float) -> None:
        self.values.modbus = values
        self.values.polls.add(now_s)
        self.values.history.append((now_s, values["force"], values["pressure"]))

    def _receive_can(self, node: CanNodeAddress) -> None:
        while not self._stop.is_set():
            with contextlib.suppress(OSError):  # if the hub has ended, `Stack.check` reports this
                for _, _, values in can_frames(node, self._stop):
                    self.values.can = {**self.values.can, **values}
                    self.values.frames.add(time.monotonic())
            self.values.can = {}
            self._stop.wait(CAN_RETRY_S)

    def _receive_truth(self, port: int) -> None:
        while not self._stop.wait(POLL_PERIOD_S):
            with (
                contextlib.suppress(OSError, ValueError),
                socket.create_connection(("127.0.0.1", port), RECONNECT_TIMEOUT_S) as control,
            ):
                control.sendall(b'{"truth": 10}\n')
                control.settimeout(READ_TIMEOUT_S)
                for line in control.makefile():
                    self.values.truth = json.loads(line)
                    if self._stop.is_set():
                        return
            self.values.truth = {}


def _read(plc: ModbusClient) -> dict[str, Any]:
    """Return the registers that change, and after a trip also the faults.

    Raises ModbusClientError.
    """
    values = plc.read()
    return values | plc.read_block(_FAULTS) if values["state"] == "tripped" else values


def value_or_nan(values: dict[str, Any], name: str) -> float:
    """Return the value of a quantity, or NaN if the quantity has not been observed yet."""
    return float(values.get(name, math.nan))
