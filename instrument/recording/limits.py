"""Limits at which a recorder ends a recording: its size, its duration, and the free space on its disk."""

from __future__ import annotations

import math
import shutil
from pathlib import Path
from typing import NamedTuple

from pneuforce.errors import ConfigurationError


class RecordingLimits(NamedTuple):
    """Limits of one recording. By default, there are none."""

    max_bytes: float = math.inf
    min_free_bytes: float = 0.0
    max_s: float = math.inf

    def reached(self, folder: Path, size_bytes: int) -> str:
        """Return which limit a recording of this size in this folder has reached; empty if none.

        Raises OSError if the free space of the disk cannot be read.
        """
        if not size_bytes < self.max_bytes:
            return f"the size limit of {self.max_bytes / 1e6:g} MB was reached"
        free_bytes = shutil.disk_usage(folder).free if self.min_free_bytes else math.inf
        if not free_bytes >= self.min_free_bytes:
            return (
                f"only {free_bytes / 1e6:.0f} MB of the disk are free, and {self.min_free_bytes / 1e6:g} MB "
                "must stay free"
            )
        return ""

    def over(self, elapsed_s: float) -> str:
        """Return that the time of the recording is over; empty if it is not over yet."""
        return f"the time of {self.max_s:g} s is over" if not elapsed_s < self.max_s else ""

    def check_start(self, folder: Path) -> None:
        """Raise ConfigurationError if a recording in this folder would reach a limit at once."""
        try:
            reason = self.reached(folder, 0)
        except OSError as error:
            reason = error.strerror or str(error)
        if reason:
            raise ConfigurationError(f"{folder.resolve()}: {reason}: delete files, or choose another folder")


NO_LIMITS = RecordingLimits()
