"""Exceptions whose message is shown to a user.

    PneuforceError
    ├── ConfigurationError (ValueError)     a file, a key or an argument is invalid
    │   ├── ConfigurationFileError          the configuration file of the instrument is invalid
    │   └── NotInstalled                    a library or a program is not installed
    ├── RigError
    │   ├── PortBusy (OSError)              another process uses the port
    │   ├── PortUnavailable (OSError)       the port does not exist, or the permission is missing
    │   ├── RigNotResponding (TimeoutError) no pneuforce board answers on the port
    │   ├── ProtocolMismatch (ValueError)   the board uses another version of the rig link
    │   └── TimeoutMismatch (ValueError)    the board and this program use different host timeouts
    ├── ServerError (OSError)               a bus or a local socket is not available
    ├── WriteFailed (OSError)               the disk is full or defective
    └── ClientError                         errors of the Python package
        ├── ConnectionFailed (OSError)      no instrument answers at an address
        │   ├── OtherRegisterMap            the instrument and this program have different register maps
    │   └── ConnectionLost              an open connection, or the samples, have stopped
        ├── Rejected                        the instrument rejected a request
        ├── VentNotConfirmed                the balloon was not verified to be empty after a vent
        ├── InvalidForce (ValueError)       the force was used, although it is not valid
        ├── HoldEnded                       the balloon is no longer held
        │   └── Tripped                     the rig has tripped
        └── UsageError                      a call that is wrong in the program
            ├── SensorClosed                the connection was closed before
            ├── AlreadyHeld                 a hold is active
            └── ReadOnlySensor              the connection cannot command the instrument

In the instrument, invalid measurements and rejected requests raise no exception: status bits and reject
reasons report them. In the Python package for clients (`pneuforce.connect`), they raise a `ClientError`.
"""

from __future__ import annotations


class PneuforceError(Exception):
    """Error that ends a command. Its message says what happened and what the user can do."""

    def __reduce__(self) -> tuple[object, ...]:
        """Return how to restore the error in another process, whatever the arguments of its class are."""
        return _restored, (type(self), self.args, self.__dict__)


def _restored(
    kind: type[PneuforceError], args: tuple[object, ...], values: dict[str, object]
) -> PneuforceError:
    error = kind.__new__(kind)
    error.args = args
    error.__dict__.update(values)
    return error


def sentence(text: str) -> str:
    """Return a text with an upper-case first letter, for use after a full stop. An address stays as it is."""
    is_address = "://" in text.split(" ", 1)[0]
    return text if is_address else text[:1].upper() + text[1:]


class ConfigurationError(PneuforceError, ValueError):
    """Invalid configuration file, key or argument."""


class ConfigurationFileError(ConfigurationError):
    """Invalid configuration file of the instrument. A person must correct the file before another attempt."""


class NotInstalled(ConfigurationError):
    """Library or program that a command needs, and that is not installed. The message has the remedy."""


class RigError(PneuforceError):
    """Error of the rig or of the cable to the rig."""


class PortBusy(RigError, OSError):
    """Serial port that another process uses."""

    def __init__(self, port: str) -> None:
        super().__init__(
            f"{port} is in use by another process, for example by a running instrument: end that process "
            f"first (a service with sudo systemctl stop pneuforce; fuser {port} shows the process)"
        )
        self.port = port


class PortUnavailable(RigError, OSError):
    """Serial port that cannot be opened."""

    def __init__(self, port: str, reason: str) -> None:
        super().__init__(f"{port} cannot be opened: {reason}")
        self.port = port


class RigNotResponding(RigError, TimeoutError):
    """Missing answer of the rig: no pneuforce board sent a Hello message before the deadline."""

    def __init__(self, port: str, waited_s: float, received_bytes: int) -> None:
        if received_bytes:
            cause = (
                f"{received_bytes} bytes came, but no valid frame: is another device connected to that port?"
            )
        else:
            cause = "no bytes came: is the board powered, flashed and connected?"
        super().__init__(f"no pneuforce board answered on {port} for {waited_s:.1f} s; {cause}")
        self.waited_s = waited_s


class ProtocolMismatch(RigError, ValueError):
    """Board with another version of the rig link protocol."""

    def __init__(self, board_version: int, host_version: int) -> None:
        super().__init__(
            f"the board uses version {board_version} of the rig link, this program version {host_version}: "
            "flash the firmware of this release; no valve was moved"
        )
        self.board_version = board_version


class TimeoutMismatch(RigError, ValueError):
    """Time limit of the board for a silent host that differs from the limit that this program requires."""

    def __init__(self, action: str, board_ms: int, host_ms: int) -> None:
        super().__init__(
            f"the board {action} after {board_ms} ms without a command, and this program requires "
            f"{host_ms} ms: flash the firmware of this release; the balloon was not inflated"
        )
        self.board_ms = board_ms
        self.host_ms = host_ms


class ServerError(PneuforceError, OSError):
    """Bus or local socket that is not available."""


class WriteFailed(PneuforceError, OSError):
    """File that cannot be written, because the disk is full or defective, or the file is too large."""


class ClientError(PneuforceError):
    """Error of a connection that `pneuforce.connect` opened, or of a call of the Python package."""


class ConnectionFailed(ClientError, OSError):
    """Missing answer: no instrument answers at the address."""


class OtherRegisterMap(ConnectionFailed):
    """Instrument with another register map, whose values this program could decode wrongly."""

    def __init__(self, url: str, map_hash: int, own_hash: int) -> None:
        super().__init__(
            f"{url}: the instrument has another version of the register map (hash {map_hash:08x}) than this "
            f"program ({own_hash:08x}): install the same version of pneuforce on both computers"
        )


class ConnectionLost(ConnectionFailed):
    """Lost connection: the instrument no longer answers, or no new samples arrive.

    If the program held the balloon with a lease, the instrument vents when the lease expires.
    """


class Rejected(ClientError):
    """Request that the instrument rejected. A rejected request moves no valve.

    `reason` is the name of the reject reason (docs/faults.md), or the name of the Modbus exception if
    there is no reject reason. `remedy` describes what to do. `fault` is the name of the first-out fault if a
    latched fault is the cause, otherwise "".
    """

    def __init__(self, request: str, reason: str, remedy: str, fault: str = "") -> None:
        super().__init__(f"{request} was rejected, reason {reason}: {remedy}")
        self.fault = fault
        self.request = request
        self.reason = reason
        self.remedy = remedy


class VentNotConfirmed(ClientError):
    """Vent that was sent, but after which the instrument did not verify that the balloon is empty.

    `pressure_kpa` is the last measured pressure, None if no pressure is available. `fault` is the name of the
    latched fault that prevents the verification, "" without one. `remedy` describes what to do, None if the
    message says it. If the instrument has reported a failed vent, VentFailed is raised at once.
    """

    def __init__(
        self, text: str, pressure_kpa: float | None, fault: str = "", remedy: str | None = None
    ) -> None:
        super().__init__(text)
        self.pressure_kpa, self.fault, self.remedy = pressure_kpa, fault, remedy


class VentFailed(VentNotConfirmed):
    """Vent after which the instrument has reported that the balloon may still be inflated."""

    def __init__(self, fault: str, cause: str, remedy: str, pressure_kpa: float | None) -> None:
        text = f"the vent was sent, but it FAILED ({fault}): {cause} {remedy}"
        super().__init__(text, pressure_kpa, fault, remedy)


class InvalidForce(ClientError, ValueError):
    """Use of a force that is not valid. A robot must then move back, and never assume 0 N.

    `reasons` contains the names of the status bits that explain the cause.
    """

    def __init__(self, reasons: tuple[str, ...], explanation: str) -> None:
        super().__init__(f"the force is not valid: {explanation}")
        self.reasons = reasons
        self.explanation = explanation


class HoldEnded(ClientError):
    """End of a hold: the balloon is no longer held at the setpoint, or did not reach the setpoint."""


class Tripped(HoldEnded):
    """Trip of the rig: the instrument commands a vent because of a fault, until the fault is cleared.

    `fault` is the name of the first-out fault ("" if it is unknown), and `remedy` describes what to do.
    """

    def __init__(self, fault: str, cause: str, remedy: str) -> None:
        explanation = " ".join(filter(None, (cause, remedy)))
        super().__init__(f"the rig has tripped ({fault or 'unknown fault'}): {explanation}")
        self.fault = fault
        self.remedy = remedy


class UsageError(ClientError):
    """Call that is wrong in the program, independent of the state of the instrument."""


class SensorClosed(UsageError):
    """Use of a connection after `close`, or after the end of its `with` statement."""


class AlreadyHeld(UsageError):
    """Second hold of a balloon that is already held, or second use of one hold."""


class ReadOnlySensor(UsageError):
    """Command over a connection that can only read, for example RDT."""
