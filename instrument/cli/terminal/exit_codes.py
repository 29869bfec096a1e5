"""Exit codes of all commands, and the code of each error. docs/how-to/command-line.md contains the table."""

from __future__ import annotations

import signal
from collections.abc import Mapping
from enum import IntEnum

from pneuforce.errors import (
    AlreadyHeld,
    ConfigurationError,
    ConfigurationFileError,
    ConnectionFailed,
    HoldEnded,
    NotInstalled,
    OtherRegisterMap,
    PneuforceError,
    Rejected,
    RigError,
    ServerError,
    UsageError,
    VentNotConfirmed,
)
from pneuforce.instrument.stream.entry import StreamError


class ExitCode(IntEnum):
    """Exit codes. The codes from 64 to 78 are those of sysexits.h."""

    DONE = 0
    FAILED = 1
    USAGE = 2
    REJECTED = 3
    HOLD_ENDED = 4
    VENT_NOT_CONFIRMED = 5
    UNAVAILABLE = 69
    NOT_INSTALLED = 72
    IO_ERROR = 74
    CONFIGURATION = 78
    INTERRUPTED = 128 + signal.SIGINT  #: the code that a shell reports after Ctrl-C


MEANINGS: Mapping[ExitCode, str] = {
    ExitCode.DONE: "the command is done",
    ExitCode.FAILED: "a check failed, no force is valid, a file is damaged, the instrument has another "
    "register map, or the command was not completed",
    ExitCode.USAGE: "an argument, or a file that an argument names, cannot be used",
    ExitCode.REJECTED: "the instrument rejected the request, or another program holds; nothing was inflated",
    ExitCode.HOLD_ENDED: "the hold ended: a trip, a vent of another client, a setpoint not reached, or an "
    "instrument that did not answer for a time; the vent is verified",
    ExitCode.VENT_NOT_CONFIRMED: "the vent was not verified: the balloon may be inflated; with "
    "`run` and `hold`, it perhaps could not be sent",
    ExitCode.UNAVAILABLE: "no instrument, rig, simulator or port answers, or a port, a file or a CAN "
    "node id is in use",
    ExitCode.NOT_INSTALLED: "a library or a program that the command needs is not installed",
    ExitCode.IO_ERROR: "the operating system reported an error, for example a full disk, or the reader of "
    "the output has ended",
    ExitCode.CONFIGURATION: "the configuration file is invalid or cannot be read; systemd does not retry",
    ExitCode.INTERRUPTED: "Ctrl-C ended the command before it could react",
}

#: Code of each class of errors. The first class that matches determines the code.
_CODES: tuple[tuple[type[BaseException], ExitCode], ...] = (
    (ConfigurationFileError, ExitCode.CONFIGURATION),
    (RigError, ExitCode.UNAVAILABLE),
    (NotInstalled, ExitCode.NOT_INSTALLED),
    (ConfigurationError, ExitCode.USAGE),
    (AlreadyHeld, ExitCode.REJECTED),
    (UsageError, ExitCode.USAGE),
    (StreamError, ExitCode.USAGE),
    (Rejected, ExitCode.REJECTED),
    (HoldEnded, ExitCode.HOLD_ENDED),
    (VentNotConfirmed, ExitCode.VENT_NOT_CONFIRMED),
    (ServerError, ExitCode.UNAVAILABLE),
    (OtherRegisterMap, ExitCode.FAILED),
    (ConnectionFailed, ExitCode.UNAVAILABLE),
    (OSError, ExitCode.IO_ERROR),
    (PneuforceError, ExitCode.FAILED),
)


def exit_code_of(error: BaseException) -> ExitCode:
    """Return the exit code of a command that ends with this error."""
    return next((code for kind, code in _CODES if isinstance(error, kind)), ExitCode.FAILED)
