"""`pneuforce evaluate`: compute the forces of a recording again, with another calibration."""

from __future__ import annotations

import logging
import math
import sys
from collections.abc import Iterable, Iterator, Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.cli.recordings.evaluation_settings import EvaluationSettings
from pneuforce.instrument.cli.recordings.export import FORMATS, write_table
from pneuforce.instrument.cli.recordings.reference_comparison import PLATEAU_TYPES, ReferenceComparison
from pneuforce.instrument.cli.terminal.failure import checked_values
from pneuforce.instrument.cli.terminal.output import json_line, print_text, progress
from pneuforce.instrument.config import Configuration
from pneuforce.instrument.recording.board_time import EXPORT_TYPES, BoardTime
from pneuforce.instrument.recording.contact_table import (
    CONTACT_TYPES,
    CUT,
    ENDED,
    OPEN,
    ContactCollector,
    RecordedContact,
    relative_contacts,
)
from pneuforce.instrument.recording.contacts import tube_time_constant_of
from pneuforce.instrument.recording.evaluation import (
    ComparedContact,
    EvaluatedSample,
    change_settings,
    evaluate_samples,
    pair_contacts,
)
from pneuforce.instrument.recording.opening import open_recording
from pneuforce.instrument.recording.reader import Recording, short_text
from pneuforce.instrument.recording.table_export import Row, check_parquet
from pneuforce.instrument.service.replay_verification import initial_session
from pneuforce.instrument.validation.reference_alignment import ReferenceInput
from pneuforce.support.atomic_file import check_new
from pneuforce.support.counted import counted

PROGRESS_SAMPLES = 1000  #: number of samples between two progress reports
MAX_LINES = 40  #: number of contacts that are shown on the terminal
#: States of a contact of which a part is not in the recording, and what follows for its force.
PARTS = (CUT, OPEN)
PARTS_REMARK = "cut, open: the recording contains only a part of the contact, so that its peak may be higher"
TOUCH_ONLY = "touch only: not a measurement"
RECORDED_TYPES = {"recorded_force_n": float, "recorded_force_std_n": float}


class EvaluationInput(NamedTuple):
    """Recording, and what it is evaluated with."""

    recording: Path
    config: Path | None = None  #: instrument.toml; None: the configuration in the recording
    calibration: Path | None = None  #: calibration file, instead of that of the configuration
    reference: ReferenceInput | None = None
    reference_gain_std: float = 0.0  #: relative standard uncertainty of the gain of the reference


class EvaluationFiles(NamedTuple):
    """Output files of an evaluation."""

    contacts: Path | None
    samples: Path | None
    overwrite: bool


class Evaluation:
    """Result of an evaluation: number of samples with a force, and the contacts."""

    def __init__(self, recorded_tube_s: float, tube_s: float) -> None:
        self.samples = self.recorded_forces = self.evaluated_forces = 0
        self._recorded, self._evaluated = ContactCollector(recorded_tube_s), ContactCollector(tube_s)

    def add(self, sample: EvaluatedSample) -> None:
        """Add one sample."""
        self.samples += 1
        self.recorded_forces += math.isfinite(sample.recorded.force_n)
        self.evaluated_forces += math.isfinite(sample.evaluated.force_n)
        self._recorded.add_sample(sample.recorded)
        self._evaluated.add_sample(sample.evaluated)

    def contacts(self, begin_s: float) -> list[ComparedContact]:
        """Return all contacts, with times since `begin_s` [s]."""
        recorded, evaluated = (
            relative_contacts(begin_s, collector.contacts())
            for collector in (self._recorded, self._evaluated)
        )
        return pair_contacts(recorded, evaluated)


def evaluate(given: EvaluationInput, files: EvaluationFiles, as_json: bool) -> int:
    """Evaluate the recording, write the files, and print the comparison.

    Return the exit code, 1 if the recording is damaged or the reference is probably wrong. Raises
    PneuforceError.
    """
    _check_files(files)
    path = given.recording
    with open_recording(path) as recording:
        settings = EvaluationSettings.of(
            recording, given.config, given.calibration, has_reference=given.reference is not None
        )
        configuration = settings.configuration
        metadata = {**recording.metadata, "evaluation": settings.facts()}
        comparison = ReferenceComparison.of(recording, given.reference, given.reference_gain_std)
        result = Evaluation(
            tube_time_constant_of(recording.metadata), configuration.chain.tube_time_constant_s
        )
        with progress("evaluating") as report:
            evaluated = comparison.follow(evaluated_samples(recording, configuration), recording.begin_s)
            samples = _counted(evaluated, result, recording, report)
            _consume(samples, files.samples, recording.begin_s, metadata)
        remark, damaged = recording.remark(), bool(recording.damage)
        if not result.samples:
            why = remark or f"{path} contains no inputs"
            raise ConfigurationError(f"no sample can be evaluated: {why}")
        contacts = result.contacts(recording.begin_s)
        if files.contacts is not None:
            types, contact_rows = _contact_table(contacts, comparison)
            write_table(files.contacts, _form(files.contacts), contact_rows, types, metadata)
        remarks = [remark, version_remark(recording), _own_recording_remark(recording, configuration)]
        remarks += configuration.unused_settings
        remark = "; ".join(filter(None, remarks))
    facts = {
        "file": str(path),
        "config": None if given.config is None else str(given.config),
        **settings.facts(),
        **_facts(result, contacts),
        **comparison.facts(),
        "remark": remark,
    }
    passed = not damaged and not comparison.is_doubtful
    if as_json:
        message = "; ".join(filter(None, [_count_text(result), *comparison.alignment(), remark]))
        print_text(json_line(checked_values(passed, message) | facts))
    else:
        if remark:
            print_text(f"pneuforce: {remark}", sys.stderr)
        print_text("\n".join([_format_result(result, contacts), *comparison.summary(), settings.summary()]))
    return 0 if passed else 1


def _consume(
    samples: Iterator[EvaluatedSample], file: Path | None, begin_s: float, metadata: Mapping[str, Any]
) -> None:
    """Evaluate all samples, and write them to `file` if it is given."""
    if file is None:
        for _ in samples:
            pass
        return
    board = BoardTime()
    rows = (_sample_row(sample, begin_s, board) for sample in samples)
    write_table(file, _form(file), rows, {**EXPORT_TYPES, **RECORDED_TYPES}, metadata)


def _check_files(files: EvaluationFiles) -> None:
    for out in (files.contacts, files.samples):
        if out is not None:
            if _form(out) == "parquet":
                check_parquet()
            check_new(out, files.overwrite)


def _form(out: Path) -> str:
    form = FORMATS.get(out.suffix.lower())
    if form is None:
        raise ConfigurationError(f"{out}: the format is unknown: name a file .csv or .parquet")
    return form


def evaluated_samples(recording: Recording, configuration: Configuration) -> Iterator[EvaluatedSample]:
    """Return each sample as recorded, and with the forces of the configuration."""
    # Do not print the log messages: the instrument has already logged them during the recording.
    logging.getLogger("pneuforce").addHandler(logging.NullHandler())
    session = initial_session(recording)
    change_settings(session, configuration.settings())
    return evaluate_samples(session, recording.entries(), recording.samples())


def _counted(
    samples: Iterable[EvaluatedSample], result: Evaluation, recording: Recording, report: Any
) -> Iterator[EvaluatedSample]:
    for sample in samples:
        result.add(sample)
        if result.samples % PROGRESS_SAMPLES == 0:
            report(result.samples, recording.sample_count)
        yield sample


def _sample_row(sample: EvaluatedSample, begin_s: float, board: BoardTime) -> Row:
    recorded, evaluated = sample
    relative = evaluated._replace(t_s=round(evaluated.t_s - begin_s, 6))
    return (*relative, board.at_s(relative), recorded.force_n, recorded.force_std_n)


def _contact_row(contact: ComparedContact) -> Row:
    return (*contact.evaluated, *_recorded_force(contact.recorded))


def _contact_table(
    contacts: list[ComparedContact], comparison: ReferenceComparison
) -> tuple[dict[str, type], list[Row]]:
    """Return the column types and the rows. With a reference, the table has its plateaus."""
    types = {**CONTACT_TYPES, **RECORDED_TYPES}
    rows = [_contact_row(contact) for contact in contacts]
    if comparison.aligned is None:
        return types, rows
    plateaus = comparison.rows(contact.evaluated for contact in contacts)
    return {**types, **PLATEAU_TYPES}, [(*row, *plateau) for row, plateau in zip(rows, plateaus, strict=True)]


def _recorded_force(contact: RecordedContact | None) -> tuple[float, float]:
    return (math.nan, math.nan) if contact is None else (contact.force_n, contact.force_std_n)


def version_remark(recording: Recording) -> str:
    """Return a remark if another version of the program made the recording, otherwise ""."""
    recorded, present = recording.metadata.get("version"), version("pneuforce")
    if recorded == present:
        return ""
    return (
        f"the recording was made by pneuforce {short_text(recorded)}, and this is pneuforce {present}: "
        "a part of the differences may come from the program"
    )


def _own_recording_remark(recording: Recording, configuration: Configuration) -> str:
    """Return a remark if the force calibration was made from this recording, otherwise ""."""
    force = (configuration.calibration or {}).get("force") or {}
    if not any(abs(at_s - recording.begin_utc_s) < 1e-3 for at_s in force.get("recordings_utc_s") or ()):
        return ""
    return (
        "the force calibration was made from this recording, so that its errors here are too small: evaluate "
        "other contacts"
    )


def _facts(result: Evaluation, contacts: list[ComparedContact]) -> dict[str, Any]:
    names = (*CONTACT_TYPES, *RECORDED_TYPES)
    return {
        "samples": result.samples,
        "samples_with_recorded_force": result.recorded_forces,
        "samples_with_evaluated_force": result.evaluated_forces,
        "contacts": [dict(zip(names, _contact_row(contact), strict=True)) for contact in contacts],
    }


def _format_result(result: Evaluation, contacts: list[ComparedContact]) -> str:
    lines = [
        _count_text(result),
        f"{'contact':>7} {'begin':>9} {'ΔP_i':>10} {'ΔP_f':>10} {'recorded ± u':>17} {'evaluated ± u':>17}  "
        "change",
    ]
    lines += [_format_contact(contact) for contact in contacts[:MAX_LINES]]
    if len(contacts) > MAX_LINES:
        more = counted(len(contacts) - MAX_LINES, "more contact")
        lines.append(f"and {more}: --contacts writes all contacts to a file")
    if any(contact.evaluated.state in PARTS for contact in contacts):
        lines.append(PARTS_REMARK)
    return "\n".join(lines)


def _count_text(result: Evaluation) -> str:
    return (
        f"{counted(result.samples, 'sample')}: {result.recorded_forces} with a recorded force, "
        f"{result.evaluated_forces} with an evaluated force"
    )


def _format_contact(contact: ComparedContact) -> str:
    new, (before_n, before_std_n) = contact.evaluated, _recorded_force(contact.recorded)
    change = 100 * (new.force_n / before_n - 1) if before_n > 0 else math.nan
    return (
        f"{new.number:>7} {new.begin_s:>z7.2f} s {new.baseline_kpa:>6.3f} kPa {new.final_kpa:>6.3f} kPa "
        f"{_format_force(before_n, before_std_n):>17} {_format_force(new.force_n, new.force_std_n):>17}  "
        f"{f'{change:+.1f} %' if math.isfinite(change) else 'n/a'}  "
        f"{'' if new.state == ENDED else new.state} {TOUCH_ONLY if new.touch_only else new.reason}"
    ).rstrip()


def _format_force(force_n: float, std_n: float) -> str:
    return f"{force_n:.3f} ± {std_n:.3f} N" if math.isfinite(force_n) else "n/a"
