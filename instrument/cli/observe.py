"""What others see of the instrument: a PLC on Modbus, a robot on CAN, and beside them the truth."""

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

from registers.can.bus import BusAt, listen
from registers.can.frames import read
from registers.modbus.client import Plc, PlcError

POLL_S = 0.05
HISTORY_S = 12.0


@dataclass(frozen=True, slots=True)
class NodeAt:
    """Where an instrument's CAN node is to be found."""

    at: BusAt
    node_id: int = 5


@dataclass(slots=True)
class Rate:
    """Events per second over the last second."""

    times_s: deque[float] = field(default_factory=lambda: deque(maxlen=2000))
    count: int = 0

    def note(self, now_s: float) -> None:
        """One more."""
        self.times_s.append(now_s)
        self.count += 1

    def per_s(self, now_s: float) -> int:
        """How many in the last second."""
        return sum(t_s > now_s - 1.0 for t_s in tuple(self.times_s))  # another thread notes meanwhile


@dataclass(slots=True)
class Seen:
    """The latest of everything, by the names of the register map."""

    modbus: dict[str, Any] = field(default_factory=dict)
    can: dict[str, Any] = field(default_factory=dict)
    truth: dict[str, Any] = field(default_factory=dict)
    polls: Rate = field(default_factory=Rate)
    frames: Rate = field(default_factory=Rate)
    history: deque[tuple[float, float, float]] = field(
        default_factory=lambda: deque(maxlen=round(HISTORY_S / POLL_S))
    )  #: time [s], force [N], pressure [kPa]


def can_frames(node: NodeAt, stop: Event) -> Iterator[tuple[float, str, dict[str, Any]]]:
    """Time, name and values of each frame of the instrument on the bus."""
    for t_s, frame in listen(node.at, stop):
        heard = read(frame, node.node_id)
        if heard is not None:
            declared, values = heard
            yield t_s, declared.name, values


class Observer:
    """Threads that poll and listen until they are stopped; what they see is in `seen`."""

    def __init__(self, plc: Plc, node: NodeAt, control_port: int) -> None:
        self.seen = Seen()
        self.failure: PlcError | None = None
        self._plc = plc
        self._stop = Event()
        self._threads = [
            Thread(target=self._poll, daemon=True),
            Thread(target=self._listen, args=(node,), daemon=True),
            Thread(target=self._follow_truth, args=(control_port,), daemon=True),
        ]

    def start(self) -> None:
        """Begin to look."""
        for thread in self._threads:
            thread.start()

    def stop(self) -> None:
        """Look no longer."""
        self._stop.set()
        for thread in self._threads:
            thread.join(0.2)

    def _poll(self) -> None:
        while not self._stop.wait(POLL_S):
            try:
                values = self._plc.read()
            except PlcError as error:
                self.failure = error
                return
            now_s = time.monotonic()
            self.seen.modbus = values
            self.seen.polls.note(now_s)
            self.seen.history.append((now_s, values["force"], values["pressure"]))

    def _listen(self, node: NodeAt) -> None:
        with contextlib.suppress(OSError):  # the hub's own end is told by its process
            for _, _, values in can_frames(node, self._stop):
                self.seen.can.update(values)
                self.seen.frames.note(time.monotonic())
        self.seen.can = {}

    def _follow_truth(self, port: int) -> None:
        while not self._stop.wait(POLL_S):
            with (
                contextlib.suppress(OSError, ValueError),
                socket.create_connection(("127.0.0.1", port), 2.0) as control,
            ):
                control.sendall(b'{"truth": 10}\n')
                control.settimeout(0.5)
                for line in control.makefile():
                    self.seen.truth = json.loads(line)
                    if self._stop.is_set():
                        return
            self.seen.truth = {}


def number(values: dict[str, Any], name: str) -> float:
    """Value of a quantity, NaN where it has not been seen."""
    return float(values.get(name, math.nan))
