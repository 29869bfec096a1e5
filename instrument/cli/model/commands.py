"""The commands about the force model: estimate, uncertainty, validate, accuracy."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pneuforce.instrument.cli.model.force_options import EstimateInput, ForceOptions
from pneuforce.instrument.cli.sim.plant_options import Contact, PlantName, PlantOptions, Rubber
from pneuforce.instrument.cli.terminal.option_groups import expand_options
from pneuforce.instrument.cli.terminal.options import InstrumentConfig, Json, Low, Overwrite, Switch

commands = typer.Typer()


@commands.command()
@expand_options
def estimate(pressures: EstimateInput, options: ForceOptions, as_json: Json = False) -> None:
    """Calculate the force of one contact, or of each contact in a table, from two pressures per contact.

    With --config, the force is that of the instrument: same balloon, law, method and calibration.
    Without a valid force, the command states the reason, and the exit code is 1.

    Example: pneuforce estimate --dpi 8.0 --dpf 9.2

    Example: pneuforce estimate --csv noted.csv --config instrument.toml --out forces.csv
    """
    from pneuforce.instrument.cli.model.estimate_run import estimate

    raise typer.Exit(estimate(pressures, options, budget=False, as_json=as_json))


@commands.command()
@expand_options
def uncertainty(pressures: EstimateInput, options: ForceOptions, as_json: Json = False) -> None:
    """Print the uncertainty budget of a force: the contribution of each input, as the GUM defines it.

    With --config, the uncertainty is that of the instrument: same balloon, law, method and calibration.
    Without a valid force, the command states the reason, and the exit code is 1.

    Example: pneuforce uncertainty --dpi 8.0 --dpf 9.2
    """
    from pneuforce.instrument.cli.model.estimate_run import estimate

    raise typer.Exit(estimate(pressures, options, budget=True, as_json=as_json))


@commands.command()
def validate(
    data: Annotated[
        Path | None, typer.Option(help="A recording with a reference force, instead of the simulated rig.")
    ] = None,
    scenario: Annotated[
        str | None,
        typer.Option(help="Scenario to simulate, campaign by default; see pneuforce sim run --list."),
    ] = None,
    plant: Annotated[
        PlantName | None, typer.Option(help="Simulated balloon, instead of the balloon of the scenario.")
    ] = None,
    rubber: Rubber = None,
    contact: Contact = None,
    seed: Annotated[
        int | None,
        typer.Option(help="Seed of the noise, instead of the seed of the scenario.", min=0, max=0xFFFF_FFFF),
    ] = None,
    switch: Switch = None,
    low: Low = None,
    config: InstrumentConfig = None,
    save: Annotated[Path | None, typer.Option(help="Write the simulated recording to this CSV file.")] = None,
    figures: Annotated[
        Path | None, typer.Option(help="Draw the figures of the paper into this folder.")
    ] = None,
    overwrite: Overwrite = False,
    as_json: Json = False,
) -> None:
    """Compare the force with a reference force, and the errors with the errors in the paper.

    With --config, the report also shows the errors of the calibrated force of the instrument.

    Example: pneuforce validate --plant membrane

    Example: pneuforce validate --data campaign.csv --config instrument.toml
    """
    from pneuforce.instrument.cli.model import validate
    from pneuforce.instrument.cli.model.validation_source import SourceOptions

    options = SourceOptions(
        data=data, scenario=scenario, plant=PlantOptions(plant, rubber, contact), seed=seed
    )
    files = validate.OutputFiles(save, figures, overwrite)
    validate.validate(options, ForceOptions(config=config, switch=switch, low=low), files, as_json)


@commands.command()
def accuracy(
    contacts: Annotated[
        int, typer.Option(help="Number of contacts for the evaluation.", min=30, max=5000)
    ] = 480,
    calibrations: Annotated[
        int, typer.Option(help="Number of calibrations with 24 contacts to average.", min=1, max=50)
    ] = 8,
    seed: Annotated[int, typer.Option(help="Seed of the contacts and of their noise.", min=0)] = 1,
    balloons: Annotated[
        int, typer.Option(help="Number of balloons in the population.", min=6, max=5000)
    ] = 200,
    as_json: Json = False,
) -> None:
    """Compare each force estimator with the true force of simulated balloons.

    Prints the document docs/accuracy.md. The calculation takes about half an hour on two processors; with
    --balloons 12, it takes some minutes.

    Example: pneuforce accuracy > docs/accuracy.md
    """
    from pneuforce.instrument.cli.model.accuracy import accuracy
    from pneuforce.instrument.studies.accuracy_document import AccuracyCampaign

    typer.echo(accuracy(AccuracyCampaign(contacts, calibrations, seed, balloons), as_json))
