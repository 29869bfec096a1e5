"""Cache directory for files that take seconds to compute."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pneuforce.support.atomic_file import replaced_file


def cache_directory() -> Path:
    """Return $XDG_CACHE_HOME/pneuforce, or ~/.cache/pneuforce."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "pneuforce"


@contextmanager
def cached_file(path: Path) -> Iterator[Path]:
    """Yield a temporary path for a file of the cache. Create the directory of the cache if it is missing.

    Other processes see the file only when it is complete. Raises OSError if the file cannot be written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    with replaced_file(path) as temporary:
        yield temporary
