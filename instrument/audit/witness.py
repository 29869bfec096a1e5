"""Comparison of an event log with the heads that an outside witness, for example Prometheus, has observed.

The witness has stored the number of records and the digest of the last record at many times. A person who
changes the log later cannot change these observations.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

from pneuforce.instrument.audit.record import Timestamp, iso_utc
from pneuforce.support.counted import counted

MAX_GAP_S = 300.0  #: a longer time without an observation is reported


class HeadSample(NamedTuple):
    """One observation: the state of the log at one time."""

    t_s: float  #: Unix time
    records: int
    head: str  #: digest of the last record, in hexadecimal


class ObservedHead(NamedTuple):
    """Head that the witness observed without interruption by another head."""

    records: int
    head: str
    first_s: float  #: Unix time of the first observation
    last_s: float


class WitnessReport(NamedTuple):
    """Result of a comparison, in sentences."""

    agrees: str
    missing: tuple[str, ...]  #: what the witness has not observed; no contradiction
    contradicts: tuple[str, ...]


def observed_heads(samples: Iterable[HeadSample]) -> list[ObservedHead]:
    """Return the heads in the order of their times. Consecutive observations of the same head are joined."""
    heads: list[ObservedHead] = []
    for t_s, records, head in sorted(samples):
        if heads and (heads[-1].records, heads[-1].head) == (records, head):
            heads[-1] = heads[-1]._replace(last_s=t_s)
        else:
            heads.append(ObservedHead(records, head, t_s, t_s))
    return heads


def gaps_in(samples: Iterable[HeadSample]) -> list[tuple[float, float]]:
    """Return begin and end (Unix time) of each time without an observation, if longer than `MAX_GAP_S`."""
    times_s = sorted({sample.t_s for sample in samples})
    return [(begin, end) for begin, end in pairwise(times_s) if end - begin > MAX_GAP_S]


def compare(
    observed: Sequence[ObservedHead],
    gaps: Sequence[tuple[float, float]],
    logs: Sequence[Mapping[int, str]],
    records: int,
) -> WitnessReport:
    """Compare the observed heads, at least one, with the logs in the order in which they were written.

    Each log maps the numbers of records to digests. `records` is the number of records of the last log.
    """
    contradicts: list[str] = []
    agreeing: list[ObservedHead] = []
    place = (0, 0)  # number of the log, and number of records, at the previous observation
    for seen in observed:
        places = [(n, seen.records) for n, log in enumerate(logs) if log.get(seen.records) == seen.head]
        if not places:
            contradicts.append(_not_found(seen, records))
        elif max(places) < place:
            contradicts.append(_went_back(seen, place[1]))
        else:
            place = min(found for found in places if found >= place)
            agreeing.append(seen)
    is_last_log = place[0] == len(logs) - 1
    return WitnessReport(
        _agreement(agreeing), tuple(_missing(gaps, records - place[1] * is_last_log)), tuple(contradicts)
    )


def _not_found(seen: ObservedHead, records: int) -> str:
    now = (
        f"the log has only {counted(records, 'record')} now: it was cut or replaced"
        if seen.records > records
        else "this record has another digest now: the log was rewritten or replaced"
    )
    return f"{_period(seen)} the log ended with record {seen.records} and the digest {seen.head}, but {now}"


def _went_back(seen: ObservedHead, before: int) -> str:
    return (
        f"{_period(seen)} the log ended with record {seen.records}, but before that it had {before} records: "
        "an older copy was in use"
    )


def _agreement(agreeing: Sequence[ObservedHead]) -> str:
    if not agreeing:
        return "no observed head is in the log"
    first, last = agreeing[0], agreeing[-1]
    return (
        f"{counted(len(agreeing), 'observed head')} from {utc_text(first.first_s)} to "
        f"{utc_text(last.last_s)}, up to record {last.records}"
    )


def _missing(gaps: Sequence[tuple[float, float]], unseen: int) -> Iterable[str]:
    if unseen > 0:
        yield f"{counted(unseen, 'record')} at the end of the log were not observed yet"
    if gaps:
        begin, end = max(gaps, key=lambda gap: gap[1] - gap[0])
        yield (
            f"{counted(len(gaps), 'time')} without an observation for more than {MAX_GAP_S:g} s, the longest "
            f"from {utc_text(begin)} to {utc_text(end)}"
        )


def _period(seen: ObservedHead) -> str:
    if seen.first_s == seen.last_s:
        return f"at {utc_text(seen.first_s)}"
    return f"from {utc_text(seen.first_s)} to {utc_text(seen.last_s)}"


def utc_text(t_s: float) -> str:
    """Return a Unix time as UTC time in the format of the event log."""
    return iso_utc(Timestamp(round(t_s * 1e6), 0.0))
