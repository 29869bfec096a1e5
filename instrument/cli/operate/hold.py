"""`pneuforce hold`: hold the balloon in the foreground, and vent at the end."""

from __future__ import annotations

import sys
import threading
import time

from pneuforce.client.address import connect
from pneuforce.client.details import LatchedFault, trip_of
from pneuforce.client.holding import Hold
from pneuforce.client.measurement import INFLATED, Measurement, State, Status
from pneuforce.client.sensor import ForceSensor
from pneuforce.errors import (
    AlreadyHeld,
    ClientError,
    ConfigurationError,
    ConnectionFailed,
    HoldEnded,
    PneuforceError,
    Rejected,
    Tripped,
    VentNotConfirmed,
    sentence,
)
from pneuforce.instrument.cli.operate.confirmed_vent import STOP_SWITCH, confirmed_vent
from pneuforce.instrument.cli.operate.instrument_address import command
from pneuforce.instrument.cli.operate.requests import explained, show_warning
from pneuforce.instrument.cli.operate.status import NOT_AVAILABLE, force_text
from pneuforce.instrument.cli.terminal.failure import failure_text
from pneuforce.instrument.cli.terminal.output import (
    json_line,
    pressure_text,
    print_done,
    print_line,
    print_text,
)
from pneuforce.instrument.cli.terminal.stop_signals import at_stop_signal

POLL_S, POLLS_PER_LINE = 0.2, 5
#: Holder of a lease that a program of this computer has taken, by the scheme of the address.
HOLDERS = {"tcp": "modbus_tcp", "rtu": "modbus_rtu", "tls": "modbus_tls"}
#: Remark behind a force that must not be used as a measurement.
TOUCH_ONLY = "touch only: not a measurement"
ALARM = "ALARM: stop pushing, and back off"


class OutputFailed(PneuforceError, OSError):
    """End of a hold whose measurements cannot be written, for example because their reader has ended."""


class EndedUnvented(VentNotConfirmed):
    """Hold that has ended, and whose vent was not verified: the balloon may be inflated."""

    def __init__(self, ended: PneuforceError, unconfirmed: ClientError) -> None:
        trip = getattr(ended, "fault", "")
        causes = [] if trip and trip == getattr(unconfirmed, "fault", "") else [failure_text(ended)]
        if not isinstance(unconfirmed, ConnectionFailed):  # otherwise the cause is the same twice
            causes.append(failure_text(unconfirmed))
        text = f"THE BALLOON MAY BE INFLATED: the hold has ended, and its vent is not verified; {STOP_SWITCH}"
        text = ". ".join([text, *(sentence(cause.rstrip(".")) for cause in causes)])
        failed = unconfirmed if getattr(unconfirmed, "fault", "") else ended
        fault, remedy = getattr(failed, "fault", ""), getattr(failed, "remedy", None)
        super().__init__(text, getattr(unconfirmed, "pressure_kpa", None), fault, remedy)


class EndedByLostConnection(HoldEnded):
    """Hold during which the instrument did not answer for a time. Its vent is verified."""

    def __init__(self, vented: str, fault: LatchedFault | None) -> None:
        text = f"the instrument did not answer for a time, so the hold has ended. {vented}"
        if fault is not None:
            text = f"{text} {sentence(str(Tripped(fault.name, fault.cause, fault.remedy)))}"
            self.fault, self.remedy = fault.name, fault.remedy
        super().__init__(text)


def hold_until_stopped(
    url: str,
    setpoint_kpa: float | None,
    lease_s: float,
    seconds: float | None,
    take_over: bool,
    as_json: bool,
) -> None:
    """Hold the balloon until a stop signal or `seconds`, vent, and confirm the vent.

    Raises ClientError if the hold fails, and EndedUnvented if its vent is not verified. Raises OutputFailed
    if a measurement cannot be written, AlreadyHeld if another program holds the balloon and `take_over` is
    False, and ConfigurationError if there is no setpoint.
    """
    stop = threading.Event()
    with connect(url) as sensor:
        if not take_over:
            _check_not_held(sensor)
        setpoint = _stored_setpoint_kpa(sensor) if setpoint_kpa is None else setpoint_kpa
        warning = show_warning(setpoint, as_json)
        hold = sensor.hold(setpoint, lease_s=lease_s)
        at_stop_signal(stop.set, hold.cancel)
        if not as_json:
            print_text(f"hold requested: vent, then {setpoint:g} kPa; Ctrl-C vents", sys.stderr)
        message = explained(sensor, lambda sensor: _held(sensor, hold, stop, seconds, as_json))
    print_done(message, as_json, warning=warning, balloon_may_be_inflated=False)


def _held(
    sensor: ForceSensor, hold: Hold, stop: threading.Event, seconds: float | None, as_json: bool
) -> str:
    """Hold the balloon and show the measurements. Return the confirmation of the vent at the end."""
    try:
        with hold:
            _show_until_stopped(sensor, stop, seconds, as_json)
    except Rejected as error:
        if error.reason != "lease":  # a rejected lease changes nothing
            _vented_after(sensor, error)
        raise
    except OutputFailed as error:
        raise OutputFailed(f"{error}, so the hold has ended. {_vented_after(sensor, error)}") from None
    except ClientError as error:
        if isinstance(error, HoldEnded) and not isinstance(error, Tripped) and stop.is_set():
            return _vented(sensor)
        vented = _vented_after(sensor, error)
        if isinstance(error, ConnectionFailed):  # but the instrument answers again
            raise EndedByLostConnection(vented, sensor.details().first_out_fault) from None
        error.add_note(vented)
        raise
    return _vented(sensor)


def _vented(sensor: ForceSensor) -> str:
    """Return the confirmation of the vent. Raises Tripped if the rig has tripped, even at the last moment."""
    vented = confirmed_vent(sensor)
    if sensor.read().state is State.TRIPPED:
        fault = sensor.details().first_out_fault
        trip = trip_of(0 if fault is None else fault.code)
        trip.add_note(vented)
        raise trip
    return vented


def _vented_after(sensor: ForceSensor, error: PneuforceError) -> str:
    """Return the confirmation of the vent after a hold that `error` has ended. Raises EndedUnvented."""
    try:
        return confirmed_vent(sensor)
    except ClientError as unconfirmed:
        raise EndedUnvented(error, unconfirmed) from None


def _show_until_stopped(
    sensor: ForceSensor, stop: threading.Event, seconds: float | None, as_json: bool
) -> None:
    """Read five times per second, and print each fifth measurement. The end of the hold raises an error."""
    started_s, polls = time.monotonic(), 0
    before: tuple[str, ...] = ()
    while not stop.is_set() and (seconds is None or time.monotonic() - started_s < seconds):
        measurement = sensor.read()
        if polls % POLLS_PER_LINE == 0:
            is_explained = bool(before) and measurement.reasons == before
            _print_measurement(_line(time.monotonic() - started_s, measurement, as_json, is_explained))
            before = measurement.reasons
        polls += 1
        stop.wait(POLL_S)


def _print_measurement(line: str) -> None:
    """Print a line. Raises OutputFailed, so that the hold ends with a message also at a closed pipe."""
    try:
        print_line(line)
    except OSError as error:
        raise OutputFailed(f"the output cannot be written: {error.strerror}") from None


def _line(held_s: float, measurement: Measurement, as_json: bool, is_explained: bool = False) -> str:
    """Return one line. If `is_explained` is True, an earlier line contains why there is no force."""
    if not as_json:
        pressure = pressure_text(measurement.pressure_kpa)
        return f"{held_s:6.1f} s  pressure {pressure}  force {_force_text(measurement, is_explained)}"
    return json_line(
        {
            "held_s": held_s,
            "state": measurement.state,
            "status": sorted(measurement.status),
            "force_n": measurement.force_or_nan,
            "force_std_n": measurement.force_std_or_nan,
            "pressure_kpa": measurement.pressure_kpa,
        }
    )


def _force_text(measurement: Measurement, is_explained: bool) -> str:
    """Return the force with remarks about its use, or why there is no force."""
    if measurement.state in (State.INFLATING, State.SETTLING):
        return f"not available while the balloon is {measurement.state}"
    alarm = [ALARM] if Status.FORCE_HIGH_ALARM in measurement.status else []
    touch = [TOUCH_ONLY] if Status.INTERPOLATED in measurement.status else []
    force = f"{NOT_AVAILABLE}, as before" if is_explained else force_text(measurement)
    return "; ".join([*alarm, force, *touch])


def _is_of_other_bus(holder: str | None, url: str) -> bool:
    """Return True if a client of another bus than that of `url` has the lease: a vent does not end it."""
    return holder != HOLDERS[url.partition("://")[0]]


def _check_not_held(sensor: ForceSensor) -> None:
    """Raise AlreadyHeld if the balloon is inflated, or if a client has the lease.

    The instrument does not reject a second hold from the same computer, because both programs are one peer.
    """
    state, details = sensor.read().state, sensor.details()
    lease = details.lease_left_s is not None
    if state in INFLATED or lease:
        holder = f"a client of {details.lease_holder} has the lease" if lease else "no client has a lease"
        anyway = f", or vent and hold anyway with {command('hold --take-over', sensor.url)}"
        if lease and _is_of_other_bus(details.lease_holder, sensor.url):
            anyway = ". The instrument rejects every hold until this client ends its lease"
        raise AlreadyHeld(
            f"another program may hold the balloon (state {state}, {holder}), and nothing was changed: end "
            f"that program{anyway}"
        )


def _stored_setpoint_kpa(sensor: ForceSensor) -> float:
    """Return the setpoint that the instrument has stored. Raises ConfigurationError."""
    setpoint_kpa = sensor.details().setpoint_requested_kpa
    if setpoint_kpa is None:
        raise ConfigurationError(
            "the instrument has no setpoint: give the setpoint in kPa, for example: pneuforce hold 6.5"
        )
    return setpoint_kpa
