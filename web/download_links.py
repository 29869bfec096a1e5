"""Links to files that an operator may download.

A browser cannot send the operator's token with a link. A request with the token therefore creates a link with
a random key, which is valid for one minute.
"""

from __future__ import annotations

import secrets
from pathlib import Path

LIFE_S = 60.0
MAX_LINKS = 16
KEY_BYTES = 24


class DownloadLinks:
    """Keys of the files that can be downloaded now."""

    def __init__(self) -> None:
        self._links: dict[str, tuple[Path, float]] = {}

    def create(self, file: Path, now_s: float) -> str:
        """Return a new key for a file. The oldest key is forgotten if there are too many."""
        while len(self._links) >= MAX_LINKS:
            del self._links[next(iter(self._links))]
        key = secrets.token_urlsafe(KEY_BYTES)
        self._links[key] = (file, now_s + LIFE_S)
        return key

    def file_of(self, key: str, now_s: float) -> Path | None:
        """Return the file of a key, None if the key is unknown or too old."""
        file, until_s = self._links.get(key, (None, 0.0))
        return file if now_s <= until_s else None
