"""`pneuforce config --check`: check that an instrument can start with a configuration file."""

from __future__ import annotations

from pathlib import Path

from pneuforce.instrument.cli.output import json_text, print_text
from pneuforce.instrument.service.start_checks import load_checked


def check_config(path: Path, as_json: bool) -> None:
    """Print that the file is valid, and its warning if it has one. Raises ConfigurationFileError."""
    warning = load_checked(path).warning
    result = {"ok": True, "file": str(path), "warning": warning or None}
    print_text(json_text(result) if as_json else f"{path}: good" + (f", but {warning}" if warning else ""))
