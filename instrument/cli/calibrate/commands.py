"""The commands `pneuforce calibrate …`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pneuforce.instrument.cli.calibrate import contacts_command
from pneuforce.instrument.cli.terminal.options import Json

commands = typer.Typer(
    name="calibrate",
    help="Calibrate one balloon and its circuit: fit measured points, and write a calibration file.",
    no_args_is_help=True,
)
commands.add_typer(contacts_command.commands)


Data = Annotated[Path, typer.Argument(help="CSV file with the names of the columns in the first line.")]
Out = Annotated[
    Path | None,
    typer.Option(
        help="Calibration file to create, or existing file to which this part is added.", dir_okay=False
    ),
]
Config = Annotated[
    Path | None,
    typer.Option("--config", help="The instrument.toml of this balloon; without it, the defaults."),
]


@commands.command()
def radius(data: Data, out: Out = None, config: Config = None, as_json: Json = False) -> None:
    """Fit the radius over the pressure, measured with a caliper.

    The CSV has the columns pressure_kpa and diameter_mm (or radius_mm).

    Example: pneuforce calibrate radius docs/examples/radius.csv --out calibration.toml
    """
    from pneuforce.instrument.cli.calibrate import steps
    from pneuforce.instrument.commissioning.previous_calibration import CalibrationTarget

    typer.echo(steps.radius(data, CalibrationTarget(out, config), as_json))


@commands.command()
def volume(
    data: Annotated[Path | None, typer.Argument(help="CSV file; without it, use the three options.")] = None,
    displaced_ml: Annotated[
        list[float] | None, typer.Option(help="Volume that the syringe displaced, in mL; once per stroke.")
    ] = None,
    before_kpa: Annotated[
        list[float] | None, typer.Option(help="Pressure before the stroke, in kPa; once per stroke.")
    ] = None,
    after_kpa: Annotated[
        list[float] | None, typer.Option(help="Pressure after the stroke, in kPa; once per stroke.")
    ] = None,
    out: Out = None,
    config: Config = None,
    as_json: Json = False,
) -> None:
    """Fit the volume of the tubes, measured with a syringe that is emptied into the tubes.

    The CSV has the columns syringe_ml (or volume_mm3) and pressure_kpa.

    Example: pneuforce calibrate volume docs/examples/volume.csv --out calibration.toml
    """
    from pneuforce.instrument.cli.calibrate import steps
    from pneuforce.instrument.commissioning.previous_calibration import CalibrationTarget

    strokes = (displaced_ml or [], before_kpa or [], after_kpa or [])
    target = CalibrationTarget(out, config)
    typer.echo(steps.volume(data, strokes, target, as_json))


@commands.command()
def lag(
    data: Data,
    filter_time_constant_s: Annotated[
        float,
        typer.Option(help="Time constant of the filter in the recorded pressure, in s.", min=0, max=1),
    ] = 0.0,
    out: Out = None,
    config: Config = None,
    as_json: Json = False,
) -> None:
    """Fit the lag of the tube from a recorded pressure step.

    The CSV has the columns t_s and pressure_kpa.

    Example: pneuforce calibrate lag docs/examples/lag.csv --out calibration.toml
    """
    from pneuforce.instrument.cli.calibrate import steps
    from pneuforce.instrument.commissioning.previous_calibration import CalibrationTarget

    target = CalibrationTarget(out, config)
    typer.echo(steps.lag(data, filter_time_constant_s, target, as_json))


@commands.command()
def grip(
    data: Annotated[Path | None, typer.Argument(help="CSV file; without it, use the three options.")] = None,
    mass_g: Annotated[
        list[float] | None, typer.Option(help="Mass on the balloon, in g; once per weight.")
    ] = None,
    before_kpa: Annotated[
        list[float] | None, typer.Option(help="Pressure without the weight, in kPa; once per weight.")
    ] = None,
    after_kpa: Annotated[
        list[float] | None, typer.Option(help="Pressure with the weight, in kPa; once per weight.")
    ] = None,
    out: Out = None,
    config: Config = None,
    as_json: Json = False,
) -> None:
    """Fit the grip of the contact for the method membrane, from known weights on the balloon.

    One weight of 100 g to 200 g is enough. The CSV has the columns mass_g, before_kpa and after_kpa.

    Example: pneuforce calibrate grip --mass-g 100 --before-kpa 8.0 --after-kpa 8.9 --out calibration.toml
    """
    from pneuforce.instrument.cli.calibrate import steps
    from pneuforce.instrument.commissioning.previous_calibration import CalibrationTarget

    weights = (mass_g or [], before_kpa or [], after_kpa or [])
    typer.echo(steps.grip(data, weights, CalibrationTarget(out, config), as_json))


@commands.command()
def force(
    data: Data,
    out: Out = None,
    config: Config = None,
    residuals: Annotated[
        Path | None, typer.Option(help="CSV file for the difference of each contact from its reference.")
    ] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the file of --residuals.")] = False,
    as_json: Json = False,
) -> None:
    """Fit the force against a reference sensor.

    The CSV has the columns baseline_kpa, final_kpa, force_n, and force_std_n if known. The force is that of
    the reference sensor, and not that of the instrument. To measure forces below 1 N, calibrate radius and
    grip instead, and use the method membrane.

    Example: pneuforce calibrate force docs/examples/reference-contacts.csv --out calibration.toml
    """
    from pneuforce.instrument.cli.calibrate import steps
    from pneuforce.instrument.commissioning.previous_calibration import CalibrationTarget

    file = steps.ResidualFile(residuals, overwrite)
    typer.echo(steps.force(data, CalibrationTarget(out, config), file, as_json))
