"""`pneuforce config --check`: check that an instrument can start with a configuration file."""

from __future__ import annotations

import json
from pathlib import Path

from pneuforce.errors import PneuforceError
from pneuforce.instrument.config import Configuration, load
from pneuforce.instrument.service.can_server import options_of
from pneuforce.instrument.service.rtu_server import check_ports


def check_config(path: Path, as_json: bool) -> int:
    """Print that the file is valid, and its warning if it has one. Return the exit code.

    Raises PneuforceError if the file is invalid. With `as_json`, no exception is raised: the error is printed
    as JSON, and the exit code is 2.
    """
    try:
        warning = _checked(path).warning
    except PneuforceError as error:
        if not as_json:
            raise
        print(json.dumps({"file": str(path), "good": False, "why": str(error)}))
        return 2
    result = {"file": str(path), "good": True, "warning": warning or None}
    print(json.dumps(result) if as_json else f"{path}: good" + (f", but {warning}" if warning else ""))
    return 0


def _checked(path: Path) -> Configuration:
    """Return the configuration after the checks that `pneuforce run` makes. Raises PneuforceError."""
    configuration = load(path)
    options_of(configuration.can)
    check_ports(configuration)
    return configuration
