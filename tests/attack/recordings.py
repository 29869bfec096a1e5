"""Damaged and forged recordings, read by each command.

Each command must end in bounded time and memory, with its result or with one sentence.
"""

from __future__ import annotations

import io
import random
import resource
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path
from tempfile import TemporaryDirectory

from pneuforce.errors import ConfigurationError, PneuforceError
from pneuforce.instrument.cli.recordings.evaluate import EvaluationFiles, EvaluationInput, evaluate
from pneuforce.instrument.cli.recordings.export import ExportOptions, export
from pneuforce.instrument.cli.recordings.plot import plot
from pneuforce.instrument.cli.recordings.replay import replay
from pneuforce.instrument.recording.opening import open_recording
from pneuforce.instrument.recording.paced_replay import PacedReplay
from pneuforce.instrument.recording.replay_source import ReplaySource
from pneuforce.instrument.service.replay_host import replay_start
from pneuforce.instrument.service.replay_verification import open_replayable
from pneuforce.instrument.stream.sample_record import SampleRecord
from pneuforce.instrument.validation.recording_plot import PlotOptions
from pneuforce.instrument.validation.reference_alignment import ReferenceInput
from tests.attack.corruption import write_damaged, write_forged
from tests.attack.result import AttackResult
from tests.instrument.recording.recording_files import comparable
from tests.instrument.recording.virtual_host import VirtualHost, write_recording

MAX_TIME_S = 15.0  #: processor time of one command, on a busy machine
MAX_GROWTH_KB = 150_000  #: growth of the memory while all files are read
MAX_SENTENCE = 1500
REFERENCE = "t_s,force_n\n" + "".join(f"{n / 50},{n % 7 / 5}\n" for n in range(500))


class TooLong(BaseException):
    """Exception for a command that does not end. It is not caught by the program."""


def make_intact(path: Path) -> None:
    """Write a recording of a few seconds that begins in a contact and contains a trip."""
    host = VirtualHost()
    host.inflate()
    host.wait_for_contact()
    host.record()
    host.run(1.0)
    host.write({"setpoint_requested_kpa": 8.2, "lease_s": 5.0})
    host.run(0.5)
    host.silence(0.4)
    host.run(0.6)
    write_recording(host.recorded(), path)


def _play(path: Path) -> None:
    """Replay a recording at the pace of a clock, as for the buses."""
    with open_replayable(path) as recording:
        paced = PacedReplay(replay_start(recording), speed=100.0)
        source, now_s = ReplaySource(paced), 0.0
        while not paced.finished and now_s < 2.0:
            for _ in paced.advance(now_s):
                pass
            source.snapshot(("web", ""), now_s)
            now_s += 0.01


def _read(path: Path) -> None:
    with open_recording(path) as recording:
        list(recording.events())
        recording.remark()


def commands_of(path: Path) -> dict[str, Callable[[], object]]:
    """Return each command that reads a recording. Its output files are in the same folder."""
    out = path.with_name
    reference = ReferenceInput(out("reference.csv"), offset_s=0.0)
    return {
        "read": lambda: _read(path),
        "replay": lambda: replay(path, as_json=False),
        "replay --config": lambda: _play(path),
        "export csv": lambda: export(path, ExportOptions(out("a.csv"), overwrite=True), as_json=True),
        "export parquet": lambda: export(
            path, ExportOptions(out("a.parquet"), overwrite=True), as_json=False
        ),
        "export validation": lambda: export(
            path,
            ExportOptions(out("v.csv"), "validation", reference=reference, overwrite=True),
            as_json=False,
        ),
        "export contacts": lambda: export(
            path, ExportOptions(out("c.csv"), contacts=True, overwrite=True), as_json=False
        ),
        "evaluate": lambda: evaluate(
            EvaluationInput(path, out("instrument.toml")),
            EvaluationFiles(out("e.csv"), out("s.csv"), True),
            as_json=True,
        ),
        "plot": lambda: plot(PlotOptions(path, out("a.png"), overwrite=True)),
        "plot --by-pressure": lambda: plot(PlotOptions(path, out("b.svg"), by_pressure=True, overwrite=True)),
        "plot --config": lambda: plot(
            PlotOptions(path, out("d.svg"), overwrite=True), out("instrument.toml")
        ),
    }


@contextmanager
def _limited_time() -> Iterator[None]:
    """Raise TooLong in the with block after `MAX_TIME_S` of processor time."""

    def end(*_: object) -> None:
        raise TooLong

    before = signal.signal(signal.SIGPROF, end)
    signal.setitimer(signal.ITIMER_PROF, MAX_TIME_S)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def _outcome(command: Callable[[], object]) -> str:
    """Run a command. Return "result" or "sentence", or a finding that begins with "!"."""
    output = io.StringIO()
    try:
        with _limited_time(), redirect_stdout(output), redirect_stderr(output):
            command()
    except PneuforceError as error:
        is_sentence = str(error).isprintable() and len(str(error)) <= MAX_SENTENCE
        return "sentence" if is_sentence else f"!not one sentence: {str(error)[:200]!r}"
    except TooLong:
        return f"!did not end within {MAX_TIME_S} s"
    except Exception as error:
        return f"!{type(error).__name__}: {str(error)[:200]}"
    shown = output.getvalue()
    is_text = shown.replace("\n", "").isprintable() and "Warning" not in shown and len(shown) <= MAX_SENTENCE
    return "result" if is_text else f"!unexpected output: {shown[:200]!r}"


def _samples_of(path: Path) -> list[SampleRecord]:
    with open_recording(path) as recording:
        return list(recording.samples())


def _shows_wrong_numbers(path: Path, intact: list[SampleRecord]) -> bool:
    """Return True if a damaged file gives other samples than the first intact ones."""
    try:
        samples = _samples_of(path)
    except ConfigurationError:
        return False
    return comparable(samples) != comparable(intact[: len(samples)])


def _memory_kb() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def attack_recordings(result: AttackResult, rng: random.Random, amount: int) -> None:
    """Read damaged and forged copies of a recording with each command."""
    longest_s = 0.0
    with TemporaryDirectory() as folder:
        path = Path(folder) / "intact.recording"
        make_intact(path)
        intact, samples = path.read_bytes(), _samples_of(path)
        path.with_name("reference.csv").write_text(REFERENCE)
        path.with_name("instrument.toml").write_text("[measurement]\n")
        for name, command in commands_of(path).items():
            result.check(_outcome(command) == "result", f"the intact recording: {name} gives no result")
        before_kb, copy = _memory_kb(), path.with_name("copy.recording")
        for number in range(amount):
            is_damaged = number % 2 == 0
            made = (write_damaged if is_damaged else write_forged)(copy, intact, rng)
            result.sent += 1
            for name, command in commands_of(copy).items():
                begun_s = time.process_time()
                outcome = _outcome(command)
                longest_s = max(longest_s, time.process_time() - begun_s)
                result.notes[outcome.split(":")[0]] += 1
                result.check(not outcome.startswith("!"), f"file {number}, {made}, {name}: {outcome}")
            if is_damaged:
                result.check(not _shows_wrong_numbers(copy, samples), f"file {number}, {made}: wrong numbers")
        growth_kb = _memory_kb() - before_kb
    result.figures.append(f"longest command {longest_s:.1f} s, memory growth {growth_kb / 1000:.0f} MB")
    result.check(growth_kb <= MAX_GROWTH_KB, f"the memory grew by {growth_kb / 1000:.0f} MB")
