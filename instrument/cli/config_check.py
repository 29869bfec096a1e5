"""`pneuforce config --check`: whether an instrument would start on a file."""

from __future__ import annotations

import json
from pathlib import Path

from instrument.cli.can_face import options_of
from instrument.cli.rtu_face import check_ports
from instrument.config import Configuration, load
from instrument.errors import PneuforceError


def check_config(path: Path, as_json: bool) -> int:
    """Say that the file is good, and what is doubtful about it. Raises PneuforceError where it is not.

    With `as_json` that is said, too, and the exit code is 2.
    """
    try:
        doubt = _checked(path).doubt
    except PneuforceError as error:
        if not as_json:
            raise
        print(json.dumps({"file": str(path), "good": False, "why": str(error)}))
        return 2
    told = {"file": str(path), "good": True, "doubt": doubt or None}
    print(json.dumps(told) if as_json else f"{path}: good" + (f", but {doubt}" if doubt else ""))
    return 0


def _checked(path: Path) -> Configuration:
    configuration = load(path)
    options_of(configuration.can)
    check_ports(configuration)
    return configuration
