"""`pneuforce config --check`: check that an instrument can start with a configuration file."""

from __future__ import annotations

from pathlib import Path

from pneuforce.errors import PneuforceError
from pneuforce.instrument.cli.exit_codes import exit_code_of
from pneuforce.instrument.cli.output import json_text, print_text
from pneuforce.instrument.service.start_checks import load_checked


def check_config(path: Path, as_json: bool) -> int:
    """Print that the file is valid, and its warning if it has one. Return the exit code.

    Raises PneuforceError if the file is invalid. With `as_json`, no exception is raised: the error is printed
    as JSON, and the exit code is that of the error.
    """
    try:
        warning = load_checked(path).warning
    except PneuforceError as error:
        if not as_json:
            raise
        print_text(json_text({"file": str(path), "good": False, "why": str(error)}))
        return exit_code_of(error)
    result = {"file": str(path), "good": True, "warning": warning or None}
    print_text(json_text(result) if as_json else f"{path}: good" + (f", but {warning}" if warning else ""))
    return 0
