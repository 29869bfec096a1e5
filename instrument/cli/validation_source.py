"""What a validation looks at: a scenario played on the simulated rig, or a recording."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from instrument.chain import ChainSettings
from instrument.cli.measured_scenario import measured
from instrument.cli.showing import Told, progress
from instrument.errors import ConfigurationError
from instrument.validation import recording
from instrument.validation.trial import Sample, Trial, trials_of
from sim.headless import Playback
from sim.rig import STEP_S
from sim.scenario import PlantTable, Scenario, ScenarioError, load

CAMPAIGN = "campaign"
TOLD_EVERY = 500  #: samples
#: What the errors of each source speak of.
NOTES = {
    "published": "The published plant obeys the energetic law itself: its errors are those of tube, "
    "filter, noise and leak, and say nothing about the law.",
    "membrane": "The membrane plant is rubber by finite elasticity. It knows nothing of the law, and the "
    "law is not calibrated to it: its errors are the law's on another balloon than the paper's.",
    "recording": "The law is the paper's, for the paper's balloon and circuit: nothing was fitted to the "
    "recording.",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """A recording, or a scenario; the scenario's own plant and seed where none is given."""

    data: Path | None = None
    scenario: str | None = None
    plant: str | None = None
    seed: int | None = None

    @property
    def name(self) -> str:
        """What sentences about it call it."""
        return str(self.data or self.scenario or CAMPAIGN)


class Source(NamedTuple):
    """Trials, and what is known of where they come from."""

    facts: dict[str, Any]
    trials: tuple[Trial, ...]
    note: str


def source_of(choice: Choice) -> Source:
    """The recording read, or the scenario played. Raises ConfigurationError."""
    if choice.data is None:
        return simulated(choice, choice.name)
    if (choice.scenario, choice.plant, choice.seed) != (None, None, None):
        raise ConfigurationError("--data is a recording: --scenario, --plant and --seed do not go with it")
    return Source({"recording": choice.data.name}, recording.read(choice.data), NOTES["recording"])


def simulated(choice: Choice, name: str) -> Source:
    """A scenario played on the chosen plant with the chosen seed. Raises ConfigurationError."""
    scenario = staged(choice, name)
    plant = scenario.plant.kind
    with progress(f"{name}, {plant} plant") as told:
        playback = Playback(scenario, told)
        trials = trials_of(_rows(playback, told))
    facts = {
        "scenario": name,
        "plant": plant,
        "seed": scenario.seed,
        "contacts": sum(len(phase.contacts) for phase in scenario.phases),
        "played_to_its_end": playback.finished,
    }
    return Source(facts, trials, NOTES[plant])


def staged(choice: Choice, name: str) -> Scenario:
    """A scenario with the chosen plant and seed. Raises ConfigurationError."""
    try:
        scenario = load(name)
    except ScenarioError as error:
        raise ConfigurationError(str(error)) from None
    changed: dict[str, Any] = {} if choice.seed is None else {"seed": choice.seed}
    if choice.plant not in (None, scenario.plant.kind):
        changed["plant"] = PlantTable.model_validate({"kind": choice.plant})
    return scenario.model_copy(update=changed)


def _rows(playback: Playback, told: Told) -> Iterator[Sample]:
    """The samples of a scenario as a recording has them."""
    for number, (measurement, truth) in enumerate(measured(playback, ChainSettings())):
        if number % TOLD_EVERY == 0:
            told(number * STEP_S, playback.expected_s)
        locked = math.isfinite(measurement.initial_kpa)
        yield Sample(truth.t_s, measurement.unfiltered_kpa, truth.force_n, "locked" if locked else None)
