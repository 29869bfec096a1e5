"""`pneuforce replay FILE`: a recording goes through this program once more, and is held against itself."""

from __future__ import annotations

import json
import logging
import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import typer

from instrument.cli.showing import progress
from instrument.coupling import Coupling
from instrument.tape.checkpoint import thaw
from instrument.tape.entry import TapeError, plain
from instrument.tape.opening import opened
from instrument.tape.reading import Recording
from instrument.tape.replay import Compared, Difference, check_version, compared
from registers.map import MAP_HASH

SHOW_EACH = 500  #: samples


class Verdict(NamedTuple):
    """What a replay found."""

    file: Path
    samples: int  #: that were compared
    recorded: int | None  #: that were to be compared; None where the file is too damaged to tell
    duration_s: float  #: of those
    took_s: float
    difference: Difference | None
    damaged: bool  #: whether there is more in the file than can be read
    remark: str  #: what is wrong with the file

    @property
    def equal(self) -> bool:
        """Whether every sample that could be read came about again."""
        return self.difference is None and not self.unexplained

    @property
    def unexplained(self) -> int:
        """Samples that no input brings about, though none of them is damaged."""
        return 0 if self.damaged else (self.recorded or 0) - self.samples

    @property
    def times_real_time(self) -> float:
        """How much faster it was than the recording."""
        return self.duration_s / self.took_s if self.took_s else math.nan


@contextmanager
def replayable(file: Path) -> Iterator[Recording]:
    """A recording that this program can replay.

    Raises ConfigurationError: none that can be read; TapeError: another program's.
    """
    with opened(file) as recording:
        try:
            check_version(recording.about, version("pneuforce"), f"{MAP_HASH:08x}")
        except TapeError as error:
            raise TapeError(f"{file}: {error}") from None
        yield recording


def start_of(recording: Recording) -> Coupling:
    """The coupling as it was when the recording began. Raises TapeError."""
    checkpoint = recording.checkpoint
    if checkpoint is None:
        raise TapeError(f"{recording.path}: what it begins with is not whole, so nothing can be replayed")
    return thaw(checkpoint.body)


def replay(file: Path, as_json: bool) -> int:
    """Verify a recording; returns the exit code, 0 only where all is there and equal.

    Raises PneuforceError.
    """
    logging.getLogger("pneuforce").addHandler(logging.NullHandler())  # what was logged then is no news
    with replayable(file) as recording:
        verdict = _verdict(recording)
    typer.echo(json.dumps(plain(_facts(verdict))) if as_json else _sentence(verdict))
    return 0 if verdict.equal and not verdict.damaged else 1


def _verdict(recording: Recording) -> Verdict:
    coupling, begun_s = start_of(recording), time.monotonic()
    samples, last = 0, Compared(recording.begin_s, None)
    with progress("replayed") as told:
        for last in compared(coupling, recording.entries(), recording.samples()):
            samples += 1
            if samples % SHOW_EACH == 0:
                told(samples, recording.most_samples)
            if last.difference is not None:
                break
    return Verdict(
        file=recording.path,
        samples=samples,
        recorded=recording.most_samples,
        duration_s=last.t_s - recording.begin_s,
        took_s=time.monotonic() - begun_s,
        difference=last.difference,
        remark=recording.remark(),
        damaged=bool(recording.damage),
    )


def _facts(verdict: Verdict) -> dict[str, Any]:
    found = verdict.difference
    return {
        "file": str(verdict.file),
        "samples": verdict.samples,
        "duration_s": verdict.duration_s,
        "took_s": verdict.took_s,
        "times_real_time": verdict.times_real_time,
        "equal": verdict.equal,
        "difference": found and found._asdict(),
        "remark": verdict.remark,
    }


def _sentence(verdict: Verdict) -> str:
    pace = f"replayed in {verdict.took_s:.1f} s, {verdict.times_real_time:.0f} times real time"
    lines = [f"{verdict.samples} samples of {verdict.duration_s:.1f} s, {pace}"]
    if verdict.difference is not None:
        lines.append(f"differs: {verdict.difference}")
    elif verdict.unexplained:
        lines.append(
            f"differs: {verdict.unexplained} more samples were recorded, and nothing brings them about"
        )
    else:
        all_ = "all that is whole is" if verdict.damaged else "all"
        lines.append(f"{all_} equal, to the last bit")
    return "\n".join([*lines, verdict.remark] if verdict.remark else lines)
