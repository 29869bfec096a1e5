"""Where files are kept that take seconds to make."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


def directory() -> Path:
    """$XDG_CACHE_HOME/pneuforce, or ~/.cache/pneuforce."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "pneuforce"


@contextmanager
def whole(path: Path) -> Iterator[Path]:
    """A file beside `path` to write to, moved there at the end, so that nobody reads half of it.

    Raises OSError where the disk does not let us.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    descriptor, name = tempfile.mkstemp(dir=path.parent, suffix=".part")
    os.close(descriptor)
    try:
        yield Path(name)
        os.replace(name, path)
    except BaseException:
        os.unlink(name)
        raise
