"""Comparison of evaluated forces with a reference force, for `pneuforce evaluate --reference`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from pneuforce.instrument.cli.aligned_reference import read_aligned
from pneuforce.instrument.recording.evaluation import EvaluatedSample
from pneuforce.instrument.recording.reader import Recording
from pneuforce.instrument.validation.plateau_forces import PlateauForces
from pneuforce.instrument.validation.reference_alignment import AlignedReference, ReferenceInput
from pneuforce.instrument.validation.reference_pairs import pair_reference
from pneuforce.support.counted import counted


@dataclass(frozen=True, slots=True)
class ReferenceComparison:
    """Reference force and the evaluated forces in its plateaus. Without a reference, it has no effect."""

    aligned: AlignedReference | None
    forces: PlateauForces

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
        paired, _ = pair_reference(course, aligned.force)
        return cls(aligned, PlateauForces(paired, gain_std))

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

    def summary(self) -> Iterator[str]:
        """Yield the alignment of the reference, and the share of the contacts within ±2u."""
        if self.aligned is None:
            return
        yield from self.aligned.summary()
        results = self.forces.results()
        within = sum(result.is_within for result in results)
        share = f" ({100 * within / len(results):.0f} %)" if results else ""
        yield f"reference force within ±2u: {within} of {counted(len(results), 'contact')}{share}"

    def facts(self) -> dict[str, Any]:
        """Return the comparison as JSON data."""
        if self.aligned is None:
            return {}
        results = self.forces.results()
        return {
            "reference": {
                **self.aligned.facts(),
                "contacts": [{**row._asdict(), "within_2u": row.is_within} for row in results],
                "within_2u": sum(row.is_within for row in results),
            }
        }
