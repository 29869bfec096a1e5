"""Hold of a balloon: inflation in the documented order, renewal of the lease, and vent at the end."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from contextlib import suppress
from types import TracebackType

from pneuforce.client.connection import HoldRequest, SensorConnection
from pneuforce.client.details import trip_of
from pneuforce.client.measurement import NOT_INFLATED, Measurement, State, Status
from pneuforce.client.rejection import fault_in_rejection
from pneuforce.client.value_checks import check_lease, check_setpoint, check_timeout
from pneuforce.errors import (
    AlreadyHeld,
    ClientError,
    ConnectionFailed,
    ConnectionLost,
    HoldEnded,
    Rejected,
    Tripped,
)

POLL_S = 0.02
VENT_TIMEOUT_S, FAULT_TIMEOUT_S = 10.0, 0.2
INFLATION_START_S = 1.0  #: longest time from the request until the state of the rig shows the inflation
VALID_TIMEOUT_S = 1.0  #: longest wait for a valid force after the setpoint was reached
RENEWALS_PER_LEASE = 3
RECONNECT_S = 0.05  #: pause before another renewal of the lease, if the connection is lost


class CurrentHold:
    """Hold that is active on a connection. A connection has at most one hold."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._hold: Hold | None = None

    def begin(self, hold: Hold) -> None:
        """Make `hold` the active hold. Raises AlreadyHeld if another hold is active."""
        with self._lock:
            if self._hold is not None:
                raise AlreadyHeld(
                    "the balloon is already held through this connection: leave the first with statement "
                    "before the next hold"
                )
            self._hold = hold

    def end(self) -> None:
        """End the active hold, if there is one: vent, and end the lease."""
        hold = self._hold
        if hold is not None:
            hold.end()

    def forget(self, hold: Hold) -> None:
        """Allow another hold after the end of `hold`."""
        with self._lock:
            if self._hold is hold:
                self._hold = None

    def check(self, measurement: Measurement) -> None:
        """Raise HoldEnded, Tripped, or the error of the lease if the active hold has failed."""
        hold = self._hold
        if hold is not None:
            hold._check(measurement)


class Hold:
    """Context in which the balloon is held at a setpoint. `ForceSensor.hold` creates it.

    The end of the context vents the balloon, also after an exception. While the context is active, a thread
    renews the lease. If the process dies, the lease expires, and the instrument vents.

    If the hold has ended inside the context, the end of the context raises HoldEnded or Tripped, unless the
    program has already received this error from `read` or from the stream. `end` does not raise these errors.
    """

    def __init__(
        self,
        connection: SensorConnection,
        current: CurrentHold,
        request: HoldRequest,
        timeout_s: float,
    ) -> None:
        check_setpoint(request.setpoint_kpa)
        check_lease(request.lease_s)
        check_timeout(timeout_s)
        self._request = request
        self._timeout_s = timeout_s
        self._connection = connection
        self._current = current
        self._settled = self._ended = False
        self._released = False  #: the lease has ended before the hold, because the balloon is vented
        self._cancelled = threading.Event()
        self._sending = threading.Lock()  #: held while the hold is requested or ended
        self._failure: ClientError | None = None
        self._reported = False  #: the program has received the error of this hold
        self._renewal = threading.Thread(target=self._renew_lease, name="lease-renewal", daemon=True)

    def __enter__(self) -> Hold:
        if self._ended:
            raise AlreadyHeld("this hold has ended: call hold() again")
        self._current.begin(self)
        try:
            self._prepare()
            self._renewal.start()
            self._wait_until_vented()
            self._begin()
            self._wait_until_held()
            self._settled = True
            self._wait_until_valid()
            self._check_not_cancelled()
        except BaseException as error:
            self._end_after(error)
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if error is not None:
            self._end_after(error)
            return
        is_known = self._ended or self._reported
        failure = None if is_known else self._unreported_failure()
        self.end()
        with suppress(ConnectionLost):  # a trip between the last measurement and the vent
            if not (is_known or failure) and self._connection.read().state is State.TRIPPED:
                failure = self._tripped()
        if failure is not None:
            raise failure

    def _unreported_failure(self) -> ClientError | None:
        """Return the error of a hold that has ended inside the context, None if the balloon is held."""
        try:
            self._check_state(self._connection.read())
        except ConnectionLost:  # `end` reports it
            return self._failure
        except ClientError as failure:
            return failure
        return self._failure

    def end(self) -> None:
        """Vent, and end the lease. Raises ConnectionLost if the instrument does not answer.

        If a trip or another client has already ended the hold, this method returns without an error.
        """
        self._cancelled.set()
        with self._sending:
            if self._ended:
                return
            self._ended = True
            try:
                if not self._released:
                    self._connection.end_hold()
            finally:
                self._current.forget(self)

    def cancel(self) -> None:
        """Make a waiting `__enter__` in another thread vent and raise HoldEnded. Does not block."""
        self._cancelled.set()

    def _check(self, measurement: Measurement) -> None:
        """Raise HoldEnded, Tripped, or the error of the lease, if the hold has failed."""
        if not self._settled or self._ended:
            return
        try:
            if self._failure is not None and measurement.state is not State.TRIPPED:
                raise self._failure.with_traceback(None)  # without the traceback of an earlier call
            self._check_state(measurement)
        except ClientError:
            self._reported = True
            raise

    # ---- steps

    def _prepare(self) -> None:
        """Take a lease and vent. Raises Rejected, and changes nothing, if another peer has the lease."""
        try:
            self._connection.prepare_hold(self._request.lease_s)
        except Rejected:
            self._ended = True
            self._current.forget(self)
            raise

    def _begin(self) -> None:
        """Request the inflation. A vent in another thread is sent after the request, or prevents it."""
        with fault_in_rejection(self._connection), self._sending:
            self._check_not_cancelled()
            self._connection.begin_hold(self._request)

    def _wait_until_vented(self) -> None:
        """Wait for a verified vent and a zero adjustment. A rig that has tripped rejects the next step."""

        def reached(m: Measurement) -> bool:
            return m.state is State.TRIPPED or (m.state is State.VENTED and Status.NOT_ZEROED not in m.status)

        if not self._wait_for(reached, VENT_TIMEOUT_S):
            raise HoldEnded(
                f"the instrument did not verify within {VENT_TIMEOUT_S:g} s that the rig is vented and the "
                "pressure sensor is zeroed: check the vent valve and the tube (pneuforce doctor)"
            )

    def _wait_until_held(self) -> None:
        begun_s = time.monotonic()

        def reached(m: Measurement) -> bool:
            if m.state is State.TRIPPED or time.monotonic() - begun_s > INFLATION_START_S:
                self._check_state(m)
            return m.state is State.HOLDING

        if not self._wait_for(reached, self._timeout_s):
            raise HoldEnded(
                f"the balloon did not reach {self._request.setpoint_kpa:g} kPa within {self._timeout_s:g} s: "
                "check the gas supply, or raise timeout_s"
            )

    def _wait_until_valid(self) -> None:
        self._wait_for(lambda m: m.valid or Status.OUT_OF_RANGE in m.status, VALID_TIMEOUT_S)

    def _wait_for(self, reached: Callable[[Measurement], bool], timeout_s: float) -> bool:
        """Return True if `reached` becomes true in time. Raises the error of the lease."""
        until_s = time.monotonic() + timeout_s
        while time.monotonic() < until_s:
            if reached(self._connection.read()):
                return True
            if self._failure is not None:
                raise self._failure.with_traceback(None)  # without the traceback of an earlier call
            self._cancelled.wait(POLL_S)
            self._check_not_cancelled()
        return False

    def _check_not_cancelled(self) -> None:
        if self._cancelled.is_set():
            raise HoldEnded("a vent was requested during the begin of the hold, so the instrument vents")

    def _check_state(self, measurement: Measurement) -> None:
        if measurement.state is State.TRIPPED:
            raise self._tripped()
        if measurement.state in NOT_INFLATED:
            raise HoldEnded(
                f"the balloon is no longer held (state {measurement.state}): an operator or another client "
                "has vented, or the instrument has ended; begin another hold when the cause is known"
            )

    def _tripped(self) -> Tripped:
        code, until_s = 0, time.monotonic() + FAULT_TIMEOUT_S
        # The state can change some milliseconds before the fault.
        while not code and time.monotonic() < until_s:
            code = self._connection.first_out_fault()
            time.sleep(0 if code else POLL_S)
        return trip_of(code)

    def _end_after(self, error: BaseException) -> None:
        """End the hold after `error`. A vent that cannot be sent is noted in `error`."""
        try:
            self.end()
        except ConnectionFailed as failure:
            cause = "" if isinstance(error, ConnectionFailed) else f": {failure}"  # not the same twice
            error.add_note(
                f"The vent could not be sent{cause}. If the instrument runs, it vents when the lease of "
                f"{self._request.lease_s:g} s expires. Otherwise press the stop switch at the rig"
            )

    # ---- thread that renews the lease

    def _renew_lease(self) -> None:
        """Renew the lease until the end of the hold, also after a time without a connection.

        A stalled instrument keeps the lease, and accepts a renewal for 0.25 s after the stall. If the lease
        has expired, the state of the rig shows it.
        """
        period_s = self._request.lease_s / RENEWALS_PER_LEASE
        pause_s = period_s
        while not self._cancelled.wait(pause_s):
            pause_s = period_s
            try:
                if self._settled:
                    self._check_state(self._connection.read())
                if self._cancelled.is_set():
                    return
                self._connection.renew_lease(self._request.lease_s)
                if self._cancelled.is_set():  # the vent can have been sent before this renewal
                    self._connection.renew_lease(0.0)
            except ConnectionLost:
                pause_s = RECONNECT_S
            except ClientError as failure:
                self._failure = failure
                if isinstance(failure, HoldEnded | Tripped):
                    self._release()
                return

    def _release(self) -> None:
        """End the lease of a balloon that is vented. Otherwise the lease would expire and trip the rig."""
        with self._sending, suppress(ClientError):
            if not self._ended:
                self._connection.end_hold()
                self._released = True
