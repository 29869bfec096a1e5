"""Connection to the instrument that is opened again after a loss, and its commands. Needs no ROS."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pneuforce
from pneuforce import ForceSensor, Hold, Measurement

RETRY_S = 1.0  #: time between two attempts to connect
#: A hold that was requested at about the same time as a vent is rejected, because their order is unknown.
VENT_PRIORITY_S = 1.0
CLOSE_TIMEOUT_S = 4.0


class CommandRejected(pneuforce.PneuforceError):
    """Command that the node does not send to the instrument."""


class SensorLink:
    """Thread that receives measurements, and commands that may be called from several threads.

    The thread connects again after a loss. It sends no command except a vent, so a new connection never
    inflates the balloon.

    `on_measurement` receives each measurement, `on_lost` the error while there is no connection, and
    `on_hold_ended` the error that ended a hold. All three are called by the thread.
    """

    def __init__(
        self,
        url: str,
        on_measurement: Callable[[Measurement], None],
        on_lost: Callable[[Exception], None],
        on_hold_ended: Callable[[Exception], None],
    ) -> None:
        self._url = url
        self._on_measurement = on_measurement
        self._on_lost = on_lost
        self._on_hold_ended = on_hold_ended
        self._sensor: ForceSensor | None = None
        self._hold: Hold | None = None
        self._lease_s = 0.0
        self._vent_requested_s = self._lost_s = -math.inf
        self._command = threading.Lock()
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="measurements", daemon=True)

    def start(self) -> None:
        """Connect in the thread."""
        self._thread.start()

    def close(self) -> None:
        """Disconnect. If the balloon is held by this node, vent before. Later commands are rejected."""
        hold = self._hold
        if hold is not None:
            hold.cancel()
        self._command.acquire(timeout=CLOSE_TIMEOUT_S)  # a hold that was cancelled vents first
        self._closing.set()
        self._thread.join(CLOSE_TIMEOUT_S)

    # ---- commands

    def vent(self) -> None:
        """Vent. The vent does not wait for another command, and ends a hold of this node.

        Raises PneuforceError if the instrument does not answer. The lease is then not renewed any more.
        """
        self._vent_requested_s = time.monotonic()
        hold = self._hold
        if hold is not None:
            hold.cancel()
        try:
            if self._sensor is not None:
                self._sensor.vent()
                self._hold = None
                return
        except pneuforce.SensorClosed:  # the thread has just closed the connection
            pass
        with pneuforce.connect(self._url) as sensor:
            sensor.vent()

    def hold(self, setpoint_kpa: float, lease_s: float, proof_tests: bool = True) -> None:
        """Inflate the balloon and return when it is held. Raises PneuforceError, and then vents."""
        with self._single_command():
            if self._hold is not None:
                raise CommandRejected("the balloon is already held by this node: vent first")
            sensor = self._connected()
            hold = sensor.hold(setpoint_kpa, lease_s=lease_s, proof_tests=proof_tests)
            self._hold, self._lease_s = hold, lease_s  # from here, a vent cancels the hold
            try:
                if time.monotonic() - self._vent_requested_s < VENT_PRIORITY_S:
                    raise CommandRejected(
                        "a vent was requested at about the same time, and a vent has priority: "
                        f"wait {VENT_PRIORITY_S:g} s, then hold"
                    )
                hold.__enter__()
            except BaseException:
                self._hold = None
                raise

    def clear(self) -> None:
        """Clear the latched faults. This command moves no valve. Raises PneuforceError."""
        with self._single_command():
            self._connected().clear()

    @contextmanager
    def _single_command(self) -> Iterator[None]:
        """Reject a command during another command. A command that waited could inflate after a vent."""
        if not self._command.acquire(blocking=False):
            raise CommandRejected("another command is not finished, or the node ends: wait, then try again")
        try:
            yield
        finally:
            self._command.release()

    def _connected(self) -> ForceSensor:
        sensor = self._sensor
        if sensor is None:
            raise CommandRejected(
                f"there is no connection to {self._url}: check that the instrument runs, and check the cable "
                "(the topic /diagnostics shows the cause)"
            )
        return sensor

    # ---- thread

    def _run(self) -> None:
        while not self._closing.is_set():
            try:
                self._connect_and_receive()
            except pneuforce.PneuforceError as error:
                self._on_lost(error)
            self._sensor = None
            self._closing.wait(RETRY_S)

    def _connect_and_receive(self) -> None:
        """Receive until the end or a loss, and disconnect. Raises PneuforceError if a step fails."""
        with pneuforce.connect(self._url) as sensor:  # the end of the context vents a held balloon
            self._vent_after_loss(sensor)
            self._sensor = sensor
            try:
                self._receive(sensor)
            except pneuforce.PneuforceError as error:
                self._lost_s = time.monotonic()
                self._on_lost(error)  # now, because a vent over a lost connection takes seconds

    def _vent_after_loss(self, sensor: ForceSensor) -> None:
        """Vent if the balloon was held when the connection was lost, and its lease can still be valid."""
        if self._hold is not None and time.monotonic() - self._lost_s <= self._lease_s:
            sensor.vent()
        self._hold = None

    def _receive(self, sensor: ForceSensor) -> None:
        """Receive measurements until the end. Raises PneuforceError if the connection is lost."""
        while not self._closing.is_set():
            try:
                for measurement in sensor.stream():
                    self._on_measurement(measurement)
                    if self._closing.is_set():
                        return
            except (pneuforce.HoldEnded, pneuforce.Rejected) as error:
                sensor.vent()
                self._hold = None
                self._on_hold_ended(error)
            except pneuforce.ConnectionLost:
                # If only the samples of the rig are missing, this read succeeds.
                self._on_measurement(sensor.read())
