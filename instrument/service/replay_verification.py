"""Verification of a recording: the samples are computed again from the recorded inputs and compared."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

from pneuforce.instrument.core.session import Session
from pneuforce.instrument.recording.checkpoint import restore_session
from pneuforce.instrument.recording.opening import open_recording
from pneuforce.instrument.recording.reader import Recording
from pneuforce.instrument.recording.replay import (
    ComparedSample,
    ReplayDifference,
    check_version,
    compare_samples,
)
from pneuforce.instrument.stream.entry import StreamError
from pneuforce.registers.map_hash import MAP_HASH

PROGRESS_SAMPLES = 500  #: number of samples between two progress reports


class ReplayResult(NamedTuple):
    """Result of a replay."""

    file: Path
    samples: int  #: number of compared samples
    recorded: int | None  #: number of samples in the file; None if the file is too damaged to count them
    duration_s: float  #: duration of the compared samples
    took_s: float  #: time that the replay took
    difference: ReplayDifference | None  #: first difference from the recording; None if there is none
    damaged: bool  #: True if a part of the file cannot be read
    remark: str  #: description of the damage; empty if there is none

    @property
    def equal(self) -> bool:
        """Return True if every readable sample was reproduced."""
        return self.difference is None and not self.unexplained

    @property
    def unexplained(self) -> int:
        """Return the number of recorded samples that the replay did not produce; 0 for a damaged file."""
        return 0 if self.damaged else (self.recorded or 0) - self.samples

    @property
    def times_real_time(self) -> float:
        """Return the speed of the replay as a multiple of the recorded speed."""
        return self.duration_s / self.took_s if self.took_s else math.nan


@contextmanager
def open_replayable(file: Path) -> Iterator[Recording]:
    """Open a recording that this version of the program can replay.

    Raises ConfigurationError if the file cannot be read, StreamError if another version wrote the file.
    """
    with open_recording(file) as recording:
        try:
            check_version(recording.metadata, version("pneuforce"), f"{MAP_HASH:08x}")
        except StreamError as error:
            raise StreamError(f"{file}: {error}") from None
        yield recording


def initial_session(recording: Recording) -> Session:
    """Return the session in its state at the start of the recording.

    Raises StreamError if the checkpoint is damaged.
    """
    checkpoint = recording.checkpoint
    if checkpoint is None:
        raise StreamError(
            f"{recording.path}: the checkpoint at the start is damaged, so a replay is not possible"
        )
    try:
        return restore_session(checkpoint.body)
    except StreamError as error:
        raise StreamError(f"{recording.path}: {error}") from None


def verify_recording(recording: Recording, report: Callable[[float, float | None], None]) -> ReplayResult:
    """Replay a recording up to the first difference.

    `report` is called with the number of compared samples and the total number of samples.

    Raises StreamError if the recording cannot be replayed.
    """
    session, started_s = initial_session(recording), time.monotonic()
    samples, last = 0, ComparedSample(recording.begin_s, None)
    for last in compare_samples(session, recording.entries(), recording.samples()):
        samples += 1
        if samples % PROGRESS_SAMPLES == 0:
            report(samples, recording.sample_count)
        if last.difference is not None:
            break
    return ReplayResult(
        file=recording.path,
        samples=samples,
        recorded=recording.sample_count,
        duration_s=last.t_s - recording.begin_s,
        took_s=time.monotonic() - started_s,
        difference=last.difference,
        remark=recording.remark(),
        damaged=bool(recording.damage),
    )
