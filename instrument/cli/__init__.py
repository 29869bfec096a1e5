"""The command `pneuforce`: the one place where instrument, registers and simulator meet."""

from __future__ import annotations

import errno
import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager

INTERRUPTED = 128 + signal.SIGINT


def main() -> None:
    """Run the command line; every expected failure is one sentence on stderr and exit code 2.

    Ctrl-C before a command has begun to listen to it ends with 130, as from a shell.
    """
    with _quiet_end():
        from instrument.cli.app import app
        from instrument.errors import PneuforceError

    try:
        try:
            app()
        finally:
            sys.stdout.flush()
    except KeyboardInterrupt:
        _end("", INTERRUPTED)
    except PneuforceError as error:
        _end(f"pneuforce: {error}", 2)
    except BrokenPipeError:
        _end("", 0)
    except OSError as error:
        full = error.errno == errno.ENOSPC
        _end(f"pneuforce: {'the output cannot be written: ' if full else ''}{error.strerror or error}", 2)


@contextmanager
def _quiet_end() -> Iterator[None]:
    """End at Ctrl-C at once: a KeyboardInterrupt within an import may come out as any other exception."""
    before = signal.getsignal(signal.SIGINT)
    if before is not signal.SIG_IGN:  # nohup's wish
        signal.signal(signal.SIGINT, lambda *_: os._exit(INTERRUPTED))
    yield
    signal.signal(signal.SIGINT, before)


def _end(sentence: str, code: int) -> None:
    """Say a sentence and end, though stdout may take no more."""
    if sentence:
        print(sentence, file=sys.stderr)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    sys.exit(code)
