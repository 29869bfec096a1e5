"""Measurements of a simulated scenario: the bytes of the rig, processed by the instrument in virtual time."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from pneuforce.instrument.measurement.chain import Chain
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.measurement.measurement import Measurement
from pneuforce.instrument.rig.link import Link, RawSample
from pneuforce.sim.headless import Playback
from pneuforce.sim.rig import Truth


def measure_playback(playback: Playback, settings: ChainSettings) -> Iterator[tuple[Measurement, Truth]]:
    """Yield the measurement of each sample, with the true values of the simulator.

    The zero of the sensor is taken as soon as the rig is vented and steady.
    """
    for [measurement], truth in measure_with_each(playback, [settings]):
        yield measurement, truth


def measure_with_each(
    playback: Playback, settings: Iterable[ChainSettings]
) -> Iterator[tuple[list[Measurement], Truth]]:
    """Yield the measurements of several instruments on the same rig, one for each element of `settings`."""
    link, chains = Link(), [Chain(each) for each in settings]
    for received in playback:
        for raw in link.feed(received, playback.now_s):
            yield [_measure(raw, chain) for chain in chains], playback.truth


def _measure(raw: RawSample, chain: Chain) -> Measurement:
    measurement = chain.step(raw)
    if not chain.zero.taken:
        chain.zero.take()
    return measurement
