"""Evaluation of a recording: the instrument computes the forces again, with other settings."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import NamedTuple

from pneuforce.instrument.core.session import Session
from pneuforce.instrument.core.settings import Settings
from pneuforce.instrument.measurement.peak import PeakTracker
from pneuforce.instrument.recording.contact_table import RecordedContact
from pneuforce.instrument.recording.replay import replay_input
from pneuforce.instrument.stream.entry import StreamEntry, StreamError
from pneuforce.instrument.stream.sample_record import SampleRecord, pack, unpack


class EvaluatedSample(NamedTuple):
    """One sample as it was recorded, and with the forces that the other settings give."""

    recorded: SampleRecord
    evaluated: SampleRecord


class ComparedContact(NamedTuple):
    """One contact with the other settings, and the recorded contact at the same time, if there is one."""

    evaluated: RecordedContact
    recorded: RecordedContact | None


def change_settings(session: Session, settings: Settings) -> None:
    """Give the session the measuring chain and the time-outs of the written pressures of `settings`.

    All other settings remain, because they have determined the course of the recording. For the same reason,
    the force does not vent the balloon.
    """
    instrument = session.instrument
    if settings.chain.tube_time_constant_s != instrument.settings.chain.tube_time_constant_s:
        instrument.peaks = PeakTracker(settings.chain.tube_time_constant_s)
    instrument.settings = replace(
        instrument.settings,
        chain=settings.chain,
        reference_timeout_s=settings.reference_timeout_s,
        ambient_timeout_s=settings.ambient_timeout_s,
        vent_on_force_limit=False,
    )
    instrument.chain.change_settings(settings.chain)


def evaluate_samples(
    session: Session, inputs: Iterable[StreamEntry], recorded: Iterable[SampleRecord]
) -> Iterator[EvaluatedSample]:
    """Yield each recorded sample with the sample that the session computes from the recorded inputs.

    The samples end when the recorded or the computed samples end. Raises StreamError if the inputs cannot be
    replayed, or if they belong to other samples.
    """
    replayed = (sample for entry in inputs for sample in replay_input(session, entry))
    for number, (before, sample) in enumerate(zip(recorded, replayed, strict=False), 1):
        now = unpack(pack(sample.raw, sample.measurement))
        if (now.sequence, now.board_time_us) != (before.sequence, before.board_time_us):
            raise StreamError(f"sample {number} does not belong to the recorded inputs")
        yield EvaluatedSample(before, now)


def pair_contacts(
    recorded: Iterable[RecordedContact], evaluated: Iterable[RecordedContact]
) -> list[ComparedContact]:
    """Return each evaluated contact with the recorded contact that has the longest time in common with it.

    Both lists are in order of time.
    """
    before, pairs, first = list(recorded), [], 0
    for contact in evaluated:
        while first < len(before) and before[first].end_s < contact.begin_s:
            first += 1
        best, longest_s = None, -1.0
        for candidate in before[first:]:
            if candidate.begin_s > contact.end_s:
                break
            common_s = min(candidate.end_s, contact.end_s) - max(candidate.begin_s, contact.begin_s)
            best, longest_s = (candidate, common_s) if common_s > longest_s else (best, longest_s)
        pairs.append(ComparedContact(contact, best))
    return pairs
