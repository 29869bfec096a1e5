"""The command `pneuforce`: the one place where instrument, registers and simulator meet."""

from __future__ import annotations

import errno
import os
import sys


def main() -> None:
    """Run the command line; every expected failure is one sentence on stderr and exit code 2."""
    from instrument.cli.app import app
    from instrument.errors import PneuforceError

    try:
        try:
            app()
        finally:
            sys.stdout.flush()
    except PneuforceError as error:
        _end(f"pneuforce: {error}", 2)
    except BrokenPipeError:
        _end("", 0)
    except OSError as error:
        full = error.errno == errno.ENOSPC
        _end(f"pneuforce: {'the output cannot be written: ' if full else ''}{error.strerror or error}", 2)


def _end(sentence: str, code: int) -> None:
    """Say a sentence and end, though stdout may take no more."""
    if sentence:
        print(sentence, file=sys.stderr)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    sys.exit(code)
