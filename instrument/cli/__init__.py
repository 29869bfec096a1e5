"""Command line interface `pneuforce`. Only this package combines instrument, registers and simulator."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from io import TextIOWrapper

#: Exit code after Ctrl-C, as a shell reports it.
INTERRUPTED = 128 + signal.SIGINT


def main() -> None:
    """Run the command line. An expected failure prints one sentence on stderr, or with --json a JSON object.

    `pneuforce.instrument.cli.terminal.exit_codes` contains the exit codes. Ctrl-C exits with code 130 if the
    command has not installed its own signal handler yet.
    """
    _replace_closed_streams()
    _print_all_characters()
    with _exit_at_once_on_interrupt():
        from pneuforce.errors import PneuforceError
        from pneuforce.instrument.cli.app import app
        from pneuforce.instrument.cli.terminal.parsing import run

    try:
        try:
            code = run(app)
        finally:
            sys.stdout.flush()
    except KeyboardInterrupt:
        _exit(INTERRUPTED)
    except BrokenPipeError:  # the reader of the output has ended, and needs no message
        from pneuforce.instrument.cli.terminal.exit_codes import ExitCode

        _exit(ExitCode.IO_ERROR)
    except PneuforceError as error:
        _fail(error)
    except OSError as error:
        from pneuforce.support.write_error import REMEDY, is_disk_error

        text = error.strerror or str(error)
        _fail(error, f"the output cannot be written: {text}: {REMEDY}" if is_disk_error(error) else text)
    else:
        sys.exit(code)


def _replace_closed_streams() -> None:
    """Open the null device for each standard stream that the caller has closed.

    Otherwise the first file that the command opens gets the number of the stream.
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            descriptor = os.open(os.devnull, os.O_RDWR)  # the lowest free number: that of the stream
            os.set_inheritable(descriptor, True)
            setattr(sys, name, os.fdopen(descriptor, mode, encoding="utf-8"))


def _print_all_characters() -> None:
    """Write UTF-8 to files and pipes. A terminal with another encoding shows ? for other characters."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(encoding=None if stream.isatty() else "utf-8", errors="replace")


@contextmanager
def _exit_at_once_on_interrupt() -> Iterator[None]:
    """Exit immediately on Ctrl-C, because an import can turn KeyboardInterrupt into another exception."""
    before = signal.getsignal(signal.SIGINT)
    if before is not signal.SIG_IGN:  # a shell lets a background job ignore SIGINT
        signal.signal(signal.SIGINT, lambda *_: os._exit(INTERRUPTED))
    yield
    signal.signal(signal.SIGINT, before)


def _fail(error: Exception, message: str | None = None) -> None:
    """Report an error, and exit with its code. `message` replaces the sentence about the error."""
    from pneuforce.instrument.cli.terminal.exit_codes import exit_code_of
    from pneuforce.instrument.cli.terminal.failure import failure_text, failure_values
    from pneuforce.instrument.cli.terminal.output import json_line
    from pneuforce.support.printable import printable

    code = exit_code_of(error)
    if "--json" in sys.argv:
        with suppress(OSError):  # stdout can be closed or full
            print(json_line(failure_values(error, message)), flush=True)
            _exit(code)
    if text := message or failure_text(error):
        with suppress(OSError):  # the exit code is the same if stderr is closed or full
            print(printable(f"pneuforce: {text}", keep="\n"), file=sys.stderr, flush=True)
    _exit(code)


def _exit(code: int) -> None:
    """Exit, even if stdout or stderr is full or closed."""
    for stream in (1, 2):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream)
    sys.exit(code)
