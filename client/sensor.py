"""Force sensor as a program uses it: read, stream, hold, vent and clear, over any bus."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import closing

from pneuforce.client.connection import HoldRequest, SensorConnection
from pneuforce.client.details import Details
from pneuforce.client.failed_vent import check_tube_proven, failed_vent, unconfirmed_vent
from pneuforce.client.holding import CurrentHold, Hold
from pneuforce.client.measurement import Measurement, Status
from pneuforce.client.rejection import fault_in_rejection
from pneuforce.client.sample_stream import new_samples
from pneuforce.client.value_checks import (
    check_bool,
    check_force_limit,
    check_longest_wait,
    check_setpoint,
    check_timeout,
)
from pneuforce.errors import ConfigurationError, SensorClosed

VENT_POLL_S = 0.05
MAX_BALLOON_ID = 0xFFFF  #: largest argument of a command


class ForceSensor:
    """Connection to one instrument. `pneuforce.connect` opens it; a `with` statement closes it.

    All methods block. They may be called from several threads.
    """

    def __init__(self, url: str, connection: SensorConnection) -> None:
        self.url = url
        self._connection = connection
        self._current_hold = CurrentHold()
        self._closed = False

    def __enter__(self) -> ForceSensor:
        self._check_open()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.url}{' (closed)' if self._closed else ''}>"

    def close(self) -> None:
        """Close the connection. If the balloon is held through this connection, vent before."""
        if self._closed:
            return
        self._closed = True
        try:
            self._current_hold.end()
        finally:
            self._connection.close()

    # ---- measure

    def read(self) -> Measurement:
        """Return the latest measurement.

        A measurement can be invalid: test `valid` before you use `force_n`. Raises ConnectionLost if the
        instrument does not answer, and HoldEnded or Tripped if the balloon is no longer held.

        If the instrument does not answer, a call over Modbus TCP blocks up to 2 s, and up to 3 s during a
        hold. In a control loop, use `stream`, which reports missing samples after about 0.1 s.

        Example:
            with pneuforce.connect("tcp://127.0.0.1:5020") as sensor:
                measurement = sensor.read()
                if measurement.valid:
                    print(f"{measurement.force_n:.3f} N ± {measurement.force_std_n:.3f} N")
                else:
                    print(f"no force: {measurement.explanation}")
        """
        self._check_open()
        return self._checked(self._connection.read())

    def stream(self, timeout_s: float = 1.0) -> Iterator[Measurement]:
        """Yield new measurements. No sample is repeated.

        If the program or the bus is slower than the instrument, samples are skipped, so that a measurement is
        never old. Modbus is polled, and yields at most 100 measurements per second. CAN yields those of the
        configured rate of the frame Force, 100 per second by default, and RDT yields all 500.
        If no new sample arrives for about 0.1 s, an invalid measurement without sample counter is yielded, so
        that the loop can react. If the loop takes a sample more than 0.1 s after its arrival, the sample is
        skipped. After a stop of this program for more than 0.15 s, for example by a debugger, no force is
        valid until all samples of that time have been skipped. If no new sample arrives for `timeout_s`,
        ConnectionLost is raised. Until then, a lost connection is opened again. HoldEnded or Tripped is
        raised if the balloon is no longer held, also after a restart of the instrument. ConfigurationError
        is raised for an invalid timeout.

        Example:
            with pneuforce.connect("tcp://127.0.0.1:5020") as sensor:
                for number, measurement in enumerate(sensor.stream()):
                    speed_mm_per_s = 2.0 * (1.5 - measurement.force_n) if measurement.valid else -5.0
                    if number == 20:
                        break
        """
        self._check_open()
        check_timeout(timeout_s)
        return self._samples(timeout_s)

    def _samples(self, timeout_s: float) -> Iterator[Measurement]:
        with closing(new_samples(self._connection, self.url, timeout_s, self._check_open)) as samples:
            for measurement in samples:
                yield self._checked(measurement)

    # ---- command

    def hold(
        self,
        setpoint_kpa: float,
        *,
        lease_s: float = 2.0,
        timeout_s: float = 20.0,
        proof_tests: bool = True,
    ) -> Hold:
        """Return a context in which the balloon is held at `setpoint_kpa` (2 to 12 kPa).

        The begin of the context takes a lease of `lease_s` (0.2 to 60 s), vents, waits for the zero
        adjustment, inflates the balloon, and returns when the setpoint is reached. If the setpoint is not
        reached within `timeout_s`, the hold fails. The end of the context vents and ends the lease, also
        after an exception.

        If another peer has the lease, the hold is rejected, and nothing is changed: the balloon of that peer
        stays inflated. A program of the same peer is not protected in this way, because it has the same
        lease. All nodes of one CAN bus together are one peer.

        A thread renews the lease three times in each `lease_s`. If the process dies, the lease expires, the
        rig trips, and the instrument vents. SIGTERM ends a Python program in this way, unless the program
        turns it into an exception, as Ctrl-C: `signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))`. If the
        program hangs, or keeps no reference to the hold, the thread still renews the lease: the balloon
        stays inflated. A process that is stopped for longer than `lease_s` loses the lease, and the rig
        trips: choose `lease_s` longer than such a pause. A stall of the instrument ends no lease.

        A proof test makes the force invalid for 0.7 s: 10 s after each new setpoint, then every 60 s without
        contact. `proof_tests=False` forbids the proof tests during the hold, for example during a movement of
        a robot.

        Raises ConfigurationError for an invalid argument before anything is sent. The begin of the context
        raises Rejected, AlreadyHeld, ReadOnlySensor, HoldEnded, Tripped or ConnectionLost. If it has
        already taken the lease, it then vents. A trip or a vent inside the context is raised by the next
        `read` or by the stream, otherwise by the end of the context. After the end of the context, a
        measurement can show the held balloon for up to 20 ms.
        """
        self._check_open()
        check_bool("proof_tests", proof_tests)
        request = HoldRequest(setpoint_kpa, lease_s, proof_tests)
        return Hold(self._connection, self._current_hold, request, timeout_s)

    def vent(self) -> None:
        """Open the vent valve. The instrument always accepts a vent, from every client.

        If the balloon is held through this connection, the hold ends, and its lease ends. If the connection
        is lost, one new connection is tried. Raises ConnectionLost if the instrument does not answer.

        Example:
            with pneuforce.connect("tcp://127.0.0.1:5020") as sensor:
                sensor.vent()
        """
        self._check_open()
        try:
            self._connection.vent()
        finally:  # even if the vent was not sent, the lease must no longer be renewed
            self._current_hold.end()

    def wait_until_vented(self, timeout_s: float = 10.0) -> Measurement:
        """Wait after a vent until the instrument has verified that the balloon is empty.

        Returns the measurement that shows the empty balloon. Raises VentFailed when the instrument reports a
        failed vent, VentNotConfirmed after `timeout_s` or if the tube is unproven, and ConnectionLost.

        CAN does not transmit whether the tube is unproven: if the status of the result contains
        `MAINTENANCE_REQUIRED`, look at the balloon, or read `details` over Modbus.

        Raises ConfigurationError if `timeout_s` is below 0 s.

        Example:
            with pneuforce.connect("tcp://127.0.0.1:5020") as sensor:
                sensor.vent()
                print(sensor.wait_until_vented().pressure_kpa)
        """
        check_longest_wait(timeout_s)
        until_s = time.monotonic() + timeout_s
        while True:
            self._check_open()
            measurement = self._connection.read()
            if measurement.balloon_empty:
                check_tube_proven(self._connection.details(), measurement.pressure_kpa)
                return measurement
            if Status.VENT_FAULT in measurement.status:
                raise failed_vent(self._connection.first_out_fault(), measurement.pressure_kpa)
            if not time.monotonic() < until_s:
                raise unconfirmed_vent(timeout_s, measurement, self._connection.details())
            time.sleep(VENT_POLL_S)

    def set_setpoint(self, setpoint_kpa: float) -> None:
        """Write the setpoint (2 to 12 kPa) of the next hold. A held balloon gets the setpoint at once.

        During a contact, the setpoint takes effect after the contact. This call needs Modbus: over CAN, it
        raises UsageError. Raises ConfigurationError, Rejected and ConnectionLost.
        """
        self._check_open()
        check_setpoint(setpoint_kpa)
        self._connection.set_setpoint(setpoint_kpa)

    def set_force_limit(self, force_limit_n: float) -> None:
        """Write the limit of the force alarm (0.1 to 20 N), for the status `FORCE_HIGH_ALARM`.

        The limit is valid until the instrument is started again. This call needs Modbus: over CAN, it raises
        UsageError. Raises ConfigurationError, Rejected and ConnectionLost.
        """
        self._check_open()
        check_force_limit(force_limit_n)
        self._connection.set_force_limit(force_limit_n)

    def release(self) -> None:
        """Vent, and end the lease of this peer, as at the normal end of a program.

        Raises Rejected, after the vent, if another peer has the lease. Raises ConnectionLost.
        """
        self._check_open()
        try:
            self._connection.release()
        finally:
            self._current_hold.end()

    def details(self) -> Details:
        """Return the first-out fault with its remedy, the requested setpoint, the lease and the versions.

        CAN transmits no faults that were latched before the connection was opened. Raises ConnectionLost.

        Example:
            with pneuforce.connect("tcp://127.0.0.1:5020") as sensor:
                fault = sensor.details().first_out_fault
                print(fault.remedy if fault else "no fault is known")
        """
        self._check_open()
        return self._connection.details()

    def clear(self) -> None:
        """Clear the latched faults. Remove their cause before. This command moves no valve.

        Raises Rejected if the cause persists, and ConnectionLost.

        Example:
            with pneuforce.connect("tcp://127.0.0.1:5020") as sensor:
                try:
                    sensor.clear()
                except pneuforce.Rejected as error:
                    print(error.reason, error.remedy)
        """
        self._check_open()
        with fault_in_rejection(self._connection):
            self._connection.run_command("clear_faults")

    def zero(self) -> None:
        """Make a zero adjustment. This command is possible only while the rig is vented.

        The instrument also makes a zero adjustment itself while the rig is vented.
        Raises Rejected and ConnectionLost.
        """
        self._check_open()
        self._connection.run_command("zero_pressure")

    def new_balloon(self, balloon_id: int) -> None:
        """Store that another balloon was mounted, with its number (0 to 65535). The rig must be vented.

        The count of inflations and the record of top-ups begin again. If the number is not that of the
        calibrated balloon, the calibration is no longer used. The number is valid until the next start. This
        call needs Modbus: CAN raises UsageError. Raises ConfigurationError, Rejected and ConnectionLost.
        """
        self._check_open()
        if isinstance(balloon_id, bool) or not (
            isinstance(balloon_id, int) and 0 <= balloon_id <= MAX_BALLOON_ID
        ):
            raise ConfigurationError(
                f"balloon_id = {balloon_id!r} is invalid: it must be an integer from 0 to {MAX_BALLOON_ID}"
            )
        self._connection.run_command("new_balloon", balloon_id)

    # ---- checks

    def _check_open(self) -> None:
        if self._closed:
            raise SensorClosed(f"the connection to {self.url} is closed: call pneuforce.connect again")

    def _checked(self, measurement: Measurement) -> Measurement:
        """Return the measurement. Raises an error if the hold of this connection has failed."""
        self._current_hold.check(measurement)
        return measurement
