"""Versions of the libraries of the web server with which the web page was tested.

The web process extends a class of uvicorn that is not public (`web/server/connection.py`). A limit in
pyproject.toml would also apply to projects that use only the Python package or the pytest plugin.
Therefore the instrument warns instead.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version

#: Library → oldest and newest tested version.
TESTED: Mapping[str, tuple[str, str]] = {"starlette": ("1.0", "1.10"), "uvicorn": ("0.40", "0.54")}


def installed_versions() -> dict[str, str]:
    """Return the installed version of each library; "" for a library that is not installed."""
    return {name: _version(name) for name in TESTED}


def untested(versions: Mapping[str, str]) -> list[str]:
    """Return one sentence for each library whose version was not tested."""
    return [
        f"the web page was tested with {name} {oldest} to {newest}, but {versions[name] or 'no version'} is "
        f"installed: if the page does not work, run: pip install {name}=={newest}.*"
        for name, (oldest, newest) in TESTED.items()
        if not _number(oldest) <= _number(versions[name]) <= _number(newest)
    ]


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return ""


def _number(text: str) -> tuple[int, ...]:
    """Return the first two numbers of a version, which identify a minor release."""
    return tuple(int(digits) for digits in re.findall(r"\d+", text)[:2])
