"""Removal of user and password from a URL that is shown in a message."""

from __future__ import annotations

import re

#: The scheme, and all up to the last @. A password that is not encoded may contain any character.
_USER = re.compile(r"^(.*?://|\W?).*@", re.DOTALL)


def without_user(text: str) -> str:
    """Return `text` with … in place of its user part: the text between the scheme and the last @."""
    return _USER.sub(r"\1…@", text)
