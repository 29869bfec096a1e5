"""A scenario measured: the bytes of a simulated rig through the instrument's own chain, faster than time."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from instrument.chain import Chain, ChainSettings
from instrument.measurement import Measurement
from instrument.rig.link import Link, RawSample
from sim.headless import Playback
from sim.rig import Truth


def measured(playback: Playback, settings: ChainSettings) -> Iterator[tuple[Measurement, Truth]]:
    """Each sample's measurement beside the truth behind it. The zero is taken as soon as it can be."""
    for [measurement], truth in measured_by_each(playback, [settings]):
        yield measurement, truth


def measured_by_each(
    playback: Playback, settings: Iterable[ChainSettings]
) -> Iterator[tuple[list[Measurement], Truth]]:
    """The same by several instruments at the same rig."""
    link, chains = Link(), [Chain(own) for own in settings]
    for sent in playback:
        for raw in link.feed(sent, playback.now_s):
            yield [_measured(raw, chain) for chain in chains], playback.truth


def _measured(raw: RawSample, chain: Chain) -> Measurement:
    measurement = chain.step(raw)
    if not chain.zero.taken:
        chain.zero.take()
    return measurement
