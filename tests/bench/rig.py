"""Benchmark of the simulated rig in virtual time."""

import timeit
from itertools import product

from pneuforce.protocol.frames import Command, CommandFlag, Identify, Mode, encode
from pneuforce.sim.hand import Hand
from pneuforce.sim.plants.membrane.plant import MembranePlant
from pneuforce.sim.plants.published import PublishedPlant
from pneuforce.sim.pneumatics import PneumaticSettings
from pneuforce.sim.rig import STEP_S, Rig
from pneuforce.sim.sensor import SensorSettings


def _us_per_step(rig, repeats, steps=500):
    """Return the time [µs] per step in the fastest of many runs, with a command every 50 ms."""
    command = encode(Command(Mode.HOLD, CommandFlag.ZEROED, 8000, 250), 1)

    def run():
        for n in range(steps):
            rig.step(b"" if n % 25 else command)

    return min(timeit.repeat(run, number=1, repeat=repeats)) / steps * 1e6


def _held(plant, pneumatics=None, sensor=None):
    """Return a rig that holds 8 kPa."""
    rig = Rig(plant, Hand(False), 1, pneumatics, sensor)
    rig.step(encode(Identify(), 0))
    for n in range(4000):
        mode = Mode.VENT if n < 1000 else Mode.HOLD
        rig.step(b"" if n % 25 else encode(Command(mode, CommandFlag.ZEROED, 8000, 250), n))
    assert rig.board.is_holding
    return rig


def bench_rig(brief=False):
    """Print the speed of the simulated rig in virtual time for each balloon model.

    Each model runs without and with all optional effects: warming, creep, and errors of the sensor.
    """
    effects = (
        PneumaticSettings(polytropic=1.2, creep=0.01, ambient_swing_kpa=0.05, reference_kpa=0.2),
        SensorSettings(gain_error=0.005, bow_kpa=0.2, ripple_mv=20.0),
    )
    for plant, settings in product((PublishedPlant(), MembranePlant()), ((), effects)):
        rig = _held(plant, *settings)
        if settings:
            rig.pneumatics.balloon_temperature.target_k = 15.0
            rig.pneumatics.circuit_temperature.target_k = 2.0
        idle_us = _us_per_step(rig, 1 if brief else 50)
        rig.hand.press(2.0)
        pressed_us = _us_per_step(rig, 1 if brief else 50)
        print(
            f"headless rig, {type(plant).__name__}{', with all effects' if settings else ''}: idle "
            f"{STEP_S * 1e6 / idle_us:.0f} × real time ({idle_us:.1f} µs per step), in contact "
            f"{STEP_S * 1e6 / pressed_us:.0f} × ({pressed_us:.1f} µs; target 100 ×)"
        )
