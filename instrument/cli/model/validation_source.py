"""Source of the trials for `pneuforce validate`: a recording, or a scenario on the simulated rig."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.cli.sim.plant_options import PlantOptions
from pneuforce.instrument.cli.terminal.output import progress
from pneuforce.instrument.studies.simulated_trials import simulate_trials
from pneuforce.instrument.validation import recording
from pneuforce.instrument.validation.clipping import clipping_remark
from pneuforce.instrument.validation.trial import Trial
from pneuforce.sim.scenario import Scenario, ScenarioError, load

DEFAULT_SCENARIO = "campaign"
ALL_FROM_SCENARIO = PlantOptions()
#: Meaning of the errors for each kind of source.
NOTES = {
    "published": "The published plant follows the energetic law itself. Its errors come from tube, "
    "filter, noise and leak, and do not show the quality of the law.",
    "membrane": "The membrane plant is a rubber balloon by finite elasticity. The law is not calibrated "
    "to it. The errors show the law of the paper on a different balloon.",
    "recording": "The law of the paper is used with the balloon and circuit of the paper. Nothing was "
    "fitted to the recording.",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class SourceOptions:
    """Selected source: a recording, or a scenario.

    The scenario determines the properties of the plant, and the seed, that are None.
    """

    data: Path | None = None
    scenario: str | None = None
    plant: PlantOptions = ALL_FROM_SCENARIO
    seed: int | None = None

    @property
    def name(self) -> str:
        """Return the name of the source for messages."""
        return str(self.data or self.scenario or DEFAULT_SCENARIO)


class ValidationSource(NamedTuple):
    """Trials, and a description of their origin."""

    facts: dict[str, Any]
    trials: tuple[Trial, ...]
    note: str
    remark: str = ""  #: problem of the recording


def load_source(options: SourceOptions) -> ValidationSource:
    """Return the trials of the recording, or simulate the scenario.

    Raises ConfigurationError if options contradict each other, or if the file or the scenario is invalid.
    """
    if options.data is None:
        return simulate_source(options, options.name)
    if (options.scenario, options.plant, options.seed) != (None, ALL_FROM_SCENARIO, None):
        raise ConfigurationError(
            "--data is a recording: --scenario, --seed, --plant, --rubber and --contact cannot be "
            "used with it"
        )
    trials = recording.read(options.data)
    return ValidationSource(
        {"recording": options.data.name}, trials, NOTES["recording"], clipping_remark(trials)
    )


def with_configuration(source: ValidationSource, config: Path) -> ValidationSource:
    """Return the source with the name of the configuration that determines the force."""
    note = "The configuration determines balloon, circuit, law and calibration."
    if "plant" in source.facts:
        note = f"{source.note} {note}"
    return source._replace(facts={**source.facts, "configuration": config.name}, note=note)


def simulate_source(options: SourceOptions, scenario_name: str) -> ValidationSource:
    """Return the trials of a scenario, simulated with the selected plant and seed.

    Raises ConfigurationError if the scenario is invalid.
    """
    scenario = selected_scenario(options, scenario_name)
    table, plant = scenario.plant, scenario.plant.kind
    with progress(f"{scenario_name}, {plant} plant") as report_progress:
        simulated = simulate_trials(scenario, report_progress)
    facts = {
        "scenario": scenario_name,
        "plant": plant,
        **({"rubber": table.material, "contact": table.contact} if plant == "membrane" else {}),
        "seed": scenario.seed,
        "contacts": sum(len(phase.contacts) for phase in scenario.phases),
        "completed": simulated.completed,
    }
    return ValidationSource(facts, simulated.trials, NOTES[plant])


def selected_scenario(options: SourceOptions, scenario_name: str) -> Scenario:
    """Return a scenario with the selected plant and seed.

    Raises ConfigurationError if the scenario is unknown or invalid, or if an option of the plant is invalid.
    """
    try:
        scenario = load(scenario_name)
    except ScenarioError as error:
        raise ConfigurationError(str(error)) from None
    changes: dict[str, Any] = {} if options.seed is None else {"seed": options.seed}
    changes["plant"] = options.plant.apply(scenario.plant)
    return scenario.model_copy(update=changes)
