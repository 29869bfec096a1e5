"""Numbers of things in messages: "1 contact", "2 contacts"."""

from __future__ import annotations


def counted(count: int, singular: str, plural: str = "") -> str:
    """Return the number and its noun. Without `plural`, the plural is the singular with an s."""
    return f"{count} {singular if count == 1 else plural or singular + 's'}"
