"""Firmware version of the board as text."""

from __future__ import annotations


def format_version(version: int) -> str:
    """Return a firmware version (major · 256 + minor) as text, for example "1.2"."""
    return f"{version >> 8}.{version & 0xFF}"
