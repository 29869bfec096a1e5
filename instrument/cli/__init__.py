"""The command `pneuforce`: the one place where instrument, registers and simulator meet."""

from __future__ import annotations

import sys


def main() -> None:
    """Run the command line; every expected failure is one sentence on stderr and exit code 2."""
    from instrument.cli.app import app
    from instrument.errors import PneuforceError

    try:
        app()
    except PneuforceError as error:
        print(f"pneuforce: {error}", file=sys.stderr)
        sys.exit(2)
    except BrokenPipeError:
        sys.stderr.close()
        sys.exit(0)
