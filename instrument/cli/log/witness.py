"""Witness of an event log: heads that Prometheus has stored, and their comparison with the log."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from pneuforce.instrument.audit.anchor import NotedDigest
from pneuforce.instrument.audit.verification import BrokenChainError
from pneuforce.instrument.audit.witness import (
    HeadSample,
    WitnessReport,
    compare,
    gaps_in,
    observed_heads,
)
from pneuforce.instrument.cli.log.prometheus_query import stored_heads
from pneuforce.support.counted import counted


class Witness:
    """Observed heads, and the report of their comparison with the log once `check` was called."""

    def __init__(self, url: str, samples: Sequence[HeadSample]) -> None:
        self.url = url
        self.report: WitnessReport | None = None
        self._observed = observed_heads(samples)
        self._gaps = gaps_in(samples)

    @property
    def noted(self) -> list[NotedDigest]:
        """Return the observed heads."""
        return [NotedDigest(seen.records, seen.head) for seen in self._observed]

    def check(self, logs: Sequence[Mapping[int, str]], records: int) -> None:
        """Compare the heads with the logs, as `compare` does. Raises BrokenChainError for a contradiction."""
        self.report = compare(self._observed, self._gaps, logs, records)
        count = len(self.report.contradicts)
        if count:
            raise BrokenChainError(
                f"{counted(count, 'observation')} of the witness {self.url} "
                f"{'contradicts' if count == 1 else 'contradict'} the log: {self.report.contradicts[0]}; "
                "name logs that were moved away with --earlier"
            )


def read_witness(url: str, instance: str | None) -> Witness:
    """Return what the Prometheus server at `url` has observed of one instrument. Raises as `stored_heads`."""
    return Witness(url, stored_heads(url, instance))
