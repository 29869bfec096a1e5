"""Command line interface `pneuforce`. Only this package combines instrument, registers and simulator."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager

#: Exit code after Ctrl-C, as a shell reports it.
INTERRUPTED = 128 + signal.SIGINT


def main() -> None:
    """Run the command line. An expected failure prints one sentence on stderr.

    `pneuforce.instrument.cli.exit_codes` contains the exit codes. Ctrl-C exits with code 130 if the command
    has not installed its own signal handler yet.
    """
    with _exit_at_once_on_interrupt():
        from pneuforce.errors import PneuforceError
        from pneuforce.instrument.cli.app import app

    try:
        try:
            app()
        finally:
            sys.stdout.flush()
    except KeyboardInterrupt:
        _exit("", INTERRUPTED)
    except PneuforceError as error:
        _fail(
            error,
            " ".join([f"{error}.", *notes]) if (notes := getattr(error, "__notes__", [])) else str(error),
        )
    except BrokenPipeError:
        _exit("", 0)
    except OSError as error:
        from pneuforce.support.write_error import REMEDY, is_disk_error

        text = error.strerror or str(error)
        _fail(error, f"the output cannot be written: {text}: {REMEDY}" if is_disk_error(error) else text)


@contextmanager
def _exit_at_once_on_interrupt() -> Iterator[None]:
    """Exit immediately on Ctrl-C, because an import can turn KeyboardInterrupt into another exception."""
    before = signal.getsignal(signal.SIGINT)
    if before is not signal.SIG_IGN:  # a shell lets a background job ignore SIGINT
        signal.signal(signal.SIGINT, lambda *_: os._exit(INTERRUPTED))
    yield
    signal.signal(signal.SIGINT, before)


def _fail(error: Exception, message: str) -> None:
    """Print the message of an error and exit with the code of the error."""
    from pneuforce.instrument.cli.exit_codes import exit_code_of

    _exit(f"pneuforce: {message}", exit_code_of(error))


def _exit(message: str, code: int) -> None:
    """Print a message on stderr and exit, even if stdout is full or closed."""
    if message:
        from pneuforce.support.printable import printable

        print(printable(message, keep="\n"), file=sys.stderr)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    sys.exit(code)
