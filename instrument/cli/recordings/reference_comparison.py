"""Comparison of evaluated forces with a reference force, for `pneuforce evaluate --reference`."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from pneuforce.instrument.cli.recordings.aligned_reference import read_aligned
from pneuforce.instrument.recording.contact_table import RecordedContact
from pneuforce.instrument.recording.evaluation import EvaluatedSample
from pneuforce.instrument.recording.reader import Recording
from pneuforce.instrument.validation.plateau_forces import PlateauForce, PlateauForces, reference_errors
from pneuforce.instrument.validation.reference_alignment import AlignedReference, ReferenceInput
from pneuforce.instrument.validation.reference_pairs import UnpairedContact, pair_reference
from pneuforce.support.counted import counted


class PlateauRow(NamedTuple):
    """Columns of a plateau in the table of contacts.

    The names differ from `reference_n`, because this force does not belong to the `final_kpa` of the contact.
    """

    plateau_begin_s: float
    plateau_force_n: float
    plateau_force_std_n: float
    plateau_reference_n: float
    plateau_reference_std_n: float


NO_PLATEAU = PlateauRow(*[math.nan] * len(PlateauRow._fields))
NO_FORCE_REASON = "the instrument does not show a force in the whole plateau"
MAX_LINES = 30  #: number of plateaus that are shown on the terminal
PLATEAU_TYPES = dict.fromkeys(PlateauRow._fields, float)


@dataclass(frozen=True, slots=True)
class ReferenceComparison:
    """Reference force and the evaluated forces in its plateaus. Without a reference, it has no effect."""

    aligned: AlignedReference | None
    forces: PlateauForces
    unpaired: tuple[UnpairedContact, ...] = ()  #: contacts without a plateau

    @classmethod
    def of(
        cls, recording: Recording, reference: ReferenceInput | None, gain_std: float
    ) -> ReferenceComparison:
        """Return the comparison with a reference, whose gain has a relative standard uncertainty.

        Raises ConfigurationError if the reference is invalid or cannot be aligned.
        """
        if reference is None:
            return cls(None, PlateauForces([]))
        course, aligned = read_aligned(recording, reference)
        paired, unpaired = pair_reference(course, aligned.force)
        return cls(aligned, PlateauForces(paired, gain_std), tuple(unpaired))

    @property
    def is_doubtful(self) -> bool:
        """Return True if the clock offset or the unit of the reference is probably wrong."""
        return self.aligned is not None and self.aligned.is_doubtful

    def follow(self, samples: Iterable[EvaluatedSample], begin_s: float) -> Iterator[EvaluatedSample]:
        """Yield the samples, and add their forces to the comparison."""
        for sample in samples:
            m = sample.evaluated
            self.forces.add(m.t_s - begin_s, m.force_n, m.force_std_n)
            yield sample

    def alignment(self) -> Iterator[str]:
        """Yield one sentence for each step of the alignment, and for each warning about the reference."""
        if self.aligned is not None:
            yield from self.aligned.summary()

    def summary(self) -> Iterator[str]:
        """Yield the alignment of the reference, the forces of the plateaus, and their errors."""
        yield from self.alignment()
        if self.aligned is None:
            return
        results = self.forces.results()
        yield from _table(results)
        errors = reference_errors(results)
        total = counted(len(results), "contact")
        if errors.with_force < len(results):
            yield f"contacts with a force in the whole plateau: {errors.with_force} of {total}"
        if errors.with_force:
            mean_n, rmse_n = errors.mean_error_n, errors.rmse_n
            yield f"mean error {mean_n:+.3f} N, RMSE {rmse_n:.3f} N (force minus reference)"
        share = f" ({100 * errors.within_2u / errors.with_force:.0f} %)" if errors.with_force else ""
        compared = counted(errors.with_force, "contact")
        yield f"reference force within ±2u: {errors.within_2u} of {compared}{share}"
        for contact in self.left_out():
            yield f"contact {contact.contact} at {contact.begin_s:z.2f} s is not compared: {contact.reason}"

    def left_out(self) -> list[UnpairedContact]:
        """Return the recorded contacts that are not compared, with the reason, in order of time."""
        without_force = [
            UnpairedContact(row.contact, row.plateau_begin_s, NO_FORCE_REASON)
            for row in self.forces.results()
            if not math.isfinite(row.error_n)
        ]
        return sorted([*self.unpaired, *without_force], key=lambda contact: contact.begin_s)

    def rows(self, contacts: Iterable[RecordedContact]) -> list[PlateauRow]:
        """Return the plateau in each contact of the evaluation, NaN if a contact has none."""
        results = self.forces.results()
        begins_s = [result.plateau_begin_s for result in results]
        rows = []
        for contact in contacts:
            index = bisect_left(begins_s, contact.begin_s)
            found = index < len(results) and begins_s[index] <= contact.end_s
            rows.append(PlateauRow(*results[index][1:]) if found else NO_PLATEAU)
        return rows

    def facts(self) -> dict[str, Any]:
        """Return the comparison as JSON data."""
        if self.aligned is None:
            return {}
        results = self.forces.results()
        return {
            "reference": {
                **self.aligned.facts(),
                "contacts": [{**row._asdict(), "within_2u": row.is_within} for row in results],
                **reference_errors(results)._asdict(),
                "left_out": [contact._asdict() for contact in self.left_out()],
            }
        }


def _table(results: Sequence[PlateauForce]) -> Iterator[str]:
    """Yield a header, and one line for each plateau in which the instrument has a force."""
    compared = [row for row in results if math.isfinite(row.error_n)]
    if compared:
        forces = f"{'force ± u':>17} {'reference ± u':>17} {'difference':>12}"
        yield f"{'contact':>7} {'plateau':>9} {forces}  within ±2u"
    for row in compared[:MAX_LINES]:
        yield (
            f"{row.contact:>7} {row.plateau_begin_s:>7.2f} s {_with_std(row.force_n, row.force_std_n):>17} "
            f"{_with_std(row.reference_n, row.reference_std_n):>17} {row.error_n:>+10.3f} N  "
            f"{'yes' if row.is_within else 'no'}"
        )
    if len(compared) > MAX_LINES:
        more = counted(len(compared) - MAX_LINES, "more contact")
        yield f"and {more}: --contacts writes all contacts to a file"


def _with_std(force_n: float, std_n: float) -> str:
    return f"{force_n:.3f} ± {std_n:.3f} N"
