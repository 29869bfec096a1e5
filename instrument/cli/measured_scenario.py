"""A scenario measured: the bytes of a simulated rig through the instrument's own chain, faster than time."""

from __future__ import annotations

from collections.abc import Iterator

from instrument.chain import Chain, ChainSettings
from instrument.measurement import Measurement
from instrument.rig.link import Link
from sim.headless import Playback
from sim.rig import Truth


def measured(playback: Playback, settings: ChainSettings) -> Iterator[tuple[Measurement, Truth]]:
    """Each sample's measurement beside the truth behind it. The zero is taken as soon as it can be."""
    link, chain = Link(), Chain(settings)
    for sent in playback:
        for raw in link.feed(sent, playback.now_s):
            measurement = chain.step(raw)
            if not chain.zero.taken:
                chain.zero.take()
            yield measurement, playback.truth
