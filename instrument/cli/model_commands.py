"""The commands about the force model: estimate, uncertainty, validate, accuracy."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pneuforce.instrument.calibration.estimation import Grip as ContactGrip
from pneuforce.instrument.cli import estimate as output
from pneuforce.instrument.cli.options import Json, Low, Method, Switch
from pneuforce.instrument.cli.plant_options import Contact, PlantName, PlantOptions, Rubber
from pneuforce.instrument.model import ForceLaw

commands = typer.Typer()

Dpi = Annotated[float, typer.Option("--dpi", help="Gauge pressure before the contact, ΔP_i, in kPa.")]
Dpf = Annotated[float, typer.Option("--dpf", help="Gauge pressure during the contact, ΔP_f, in kPa.")]
Grip = Annotated[
    float | None,
    typer.Option(
        help="Grip of the contact, method membrane: 0 if the skin slides, 1 if it sticks.",
        min=0,
        max=1,
    ),
]
GripStd = Annotated[
    float | None,
    typer.Option(help="Standard uncertainty of the grip; by default, that of an unknown grip.", min=0, max=1),
]
PressedSides = Annotated[
    int,
    typer.Option(help="Number of sides on which the balloon is pressed, method membrane.", min=1, max=2),
]
CalibrationFile = Annotated[
    Path | None,
    typer.Option("--calibration", help="Calibration file of the balloon; by default, the paper's balloon."),
]


@commands.command()
def estimate(
    dpi: Dpi,
    dpf: Dpf,
    method: Method = "energetic",
    switch: Switch = "paper",
    low: Low = "line",
    grip: Grip = None,
    grip_std: GripStd = None,
    pressed_sides: PressedSides = 1,
    calibration: CalibrationFile = None,
    as_json: Json = False,
) -> None:
    """Calculate the force of one contact from the pressures before and during the contact.

    Example: pneuforce estimate --dpi 8.0 --dpf 9.2
    """
    law = ForceLaw(method=method, switch=switch, low=low, sides=pressed_sides)
    contact = output.estimate_contact(
        dpi, dpf, output.chain_settings(law, ContactGrip(grip, grip_std), calibration)
    )
    typer.echo(output.estimate_json(contact) if as_json else output.format_estimate(contact))


@commands.command()
def uncertainty(
    dpi: Dpi,
    dpf: Dpf,
    method: Method = "energetic",
    switch: Switch = "paper",
    low: Low = "line",
    grip: Grip = None,
    grip_std: GripStd = None,
    pressed_sides: PressedSides = 1,
    calibration: CalibrationFile = None,
    as_json: Json = False,
) -> None:
    """Print the uncertainty budget of a force: the contribution of each input, as the GUM defines it.

    Example: pneuforce uncertainty --dpi 8.0 --dpf 9.2
    """
    law = ForceLaw(method=method, switch=switch, low=low, sides=pressed_sides)
    contact = output.estimate_contact(
        dpi, dpf, output.chain_settings(law, ContactGrip(grip, grip_std), calibration)
    )
    typer.echo(output.budget_json(contact) if as_json else output.format_budget(contact))


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
    switch: Switch = "paper",
    low: Low = "line",
    save: Annotated[Path | None, typer.Option(help="Write the simulated recording to this CSV file.")] = None,
    figures: Annotated[
        Path | None, typer.Option(help="Draw the figures of the paper into this folder.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Compare the force with a reference force, and the errors with the errors in the paper.

    Example: pneuforce validate --plant membrane
    """
    from pneuforce.instrument.cli import validate
    from pneuforce.instrument.cli.validation_source import SourceOptions

    options = SourceOptions(
        data=data, scenario=scenario, plant=PlantOptions(plant, rubber, contact), seed=seed
    )
    validate.validate(options, ForceLaw(switch=switch, low=low), save, figures, as_json)


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
    from pneuforce.instrument.cli.accuracy import accuracy
    from pneuforce.instrument.studies.accuracy_document import AccuracyCampaign

    typer.echo(accuracy(AccuracyCampaign(contacts, calibrations, seed, balloons), as_json))
