"""The commands about the force model: estimate, uncertainty, validate, accuracy."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pneuforce.instrument.cli.options import InstrumentConfig, Json, Low, Out, Overwrite, Switch
from pneuforce.instrument.cli.plant_options import Contact, PlantName, PlantOptions, Rubber
from pneuforce.instrument.model import law

commands = typer.Typer()

Dpi = Annotated[float | None, typer.Option("--dpi", help="Gauge pressure before the contact, ΔP_i, in kPa.")]
Dpf = Annotated[float | None, typer.Option("--dpf", help="Gauge pressure during the contact, ΔP_f, in kPa.")]
ContactsFile = Annotated[
    Path | None,
    typer.Option(
        "--csv",
        help="CSV file with one contact per line, instead of --dpi and --dpf: columns baseline_kpa and "
        "final_kpa.",
    ),
]
Method = Annotated[law.MethodName | None, typer.Option(help="Force model.", show_default="energetic")]
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
    int | None,
    typer.Option(
        help="Number of sides on which the balloon is pressed, method membrane.",
        min=1,
        max=2,
        show_default="1",
    ),
]
CalibrationFile = Annotated[
    Path | None,
    typer.Option("--calibration", help="Calibration file of the balloon; by default, the paper's balloon."),
]


@commands.command()
def estimate(
    dpi: Dpi = None,
    dpf: Dpf = None,
    contacts: ContactsFile = None,
    config: InstrumentConfig = None,
    method: Method = None,
    switch: Switch = None,
    low: Low = None,
    grip: Grip = None,
    grip_std: GripStd = None,
    pressed_sides: PressedSides = None,
    calibration: CalibrationFile = None,
    out: Out = None,
    overwrite: Overwrite = False,
    as_json: Json = False,
) -> None:
    """Calculate the force of one contact, or of each contact in a table, from two pressures per contact.

    With --config, the force is that of the instrument: same balloon, law, method and calibration.

    Example: pneuforce estimate --dpi 8.0 --dpf 9.2

    Example: pneuforce estimate --csv contacts.csv --config instrument.toml --out forces.csv
    """
    from pneuforce.instrument.cli.estimate_run import EstimateInput, estimate
    from pneuforce.instrument.cli.force_settings import ForceOptions

    options = ForceOptions(
        config=config,
        method=method,
        switch=switch,
        low=low,
        grip=grip,
        grip_std=grip_std,
        pressed_sides=pressed_sides,
        calibration=calibration,
    )
    estimate(EstimateInput(dpi, dpf, contacts, out, overwrite), options, budget=False, as_json=as_json)


@commands.command()
def uncertainty(
    dpi: Dpi = None,
    dpf: Dpf = None,
    contacts: ContactsFile = None,
    config: InstrumentConfig = None,
    method: Method = None,
    switch: Switch = None,
    low: Low = None,
    grip: Grip = None,
    grip_std: GripStd = None,
    pressed_sides: PressedSides = None,
    calibration: CalibrationFile = None,
    out: Out = None,
    overwrite: Overwrite = False,
    as_json: Json = False,
) -> None:
    """Print the uncertainty budget of a force: the contribution of each input, as the GUM defines it.

    With --config, the uncertainty is that of the instrument: same balloon, law, method and calibration.

    Example: pneuforce uncertainty --dpi 8.0 --dpf 9.2
    """
    from pneuforce.instrument.cli.estimate_run import EstimateInput, estimate
    from pneuforce.instrument.cli.force_settings import ForceOptions

    options = ForceOptions(
        config=config,
        method=method,
        switch=switch,
        low=low,
        grip=grip,
        grip_std=grip_std,
        pressed_sides=pressed_sides,
        calibration=calibration,
    )
    estimate(EstimateInput(dpi, dpf, contacts, out, overwrite), options, budget=True, as_json=as_json)


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

    Example: pneuforce validate --data cell.csv --config instrument.toml
    """
    from pneuforce.instrument.cli import validate
    from pneuforce.instrument.cli.force_settings import ForceOptions
    from pneuforce.instrument.cli.validation_source import SourceOptions

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
    from pneuforce.instrument.cli.accuracy import accuracy
    from pneuforce.instrument.studies.accuracy_document import AccuracyCampaign

    typer.echo(accuracy(AccuracyCampaign(contacts, calibrations, seed, balloons), as_json))
