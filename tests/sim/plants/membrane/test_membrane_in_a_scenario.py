import pytest

from pneuforce.sim.factory import build_plant
from pneuforce.sim.headless import Playback
from pneuforce.sim.scenario import load

SCENARIO = """
doc = "A tool that moves against a spring."
[plant]
kind = "membrane"
material = "neo-hookean"
sides = 2
[[phase]]
setpoint_kpa = 8.0
[[phase.contact]]
kind = "press"
travel_mm = 3.0
tissue = { law = "linear", stiffness_n_per_mm = 0.5 }
"""


def test_a_scenario_can_press_a_membrane_balloon_against_tissue(tmp_path, two_sided):
    path = tmp_path / "mine.toml"
    path.write_text(SCENARIO)
    scenario = load(str(path))
    plant = build_plant(scenario.plant)
    assert (plant.material, plant.sides) == (two_sided.material, two_sided.sides)
    playback, deepest = Playback(scenario), None
    for _ in playback:
        if playback.truth.force_n > (deepest.force_n if deepest else 0.0):
            deepest = playback.truth
    assert playback.finished
    assert deepest.indentation_mm + deepest.force_n / 0.5 == pytest.approx(3.0, abs=1e-3)
    assert deepest.indentation_mm > 1.0
