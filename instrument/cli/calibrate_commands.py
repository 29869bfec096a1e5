"""The commands `pneuforce calibrate …` and their help."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from instrument.cli.options import Json, PlantName

commands = typer.Typer(
    name="calibrate",
    help="Measure one balloon and its circuit: recorded points in, a dated calibration file out.",
    no_args_is_help=True,
)


Data = Annotated[Path, typer.Argument(help="CSV file; its first line names the columns.")]
Out = Annotated[
    Path | None, typer.Option(help="Calibration file to write, or to add this part to.", dir_okay=False)
]
Config = Annotated[
    Path | None,
    typer.Option("--config", help="The instrument.toml of this balloon; without it, the defaults."),
]


@commands.command()
def radius(data: Data, out: Out = None, config: Config = None, as_json: Json = False) -> None:
    """Radius over pressure, from a caliper: columns pressure_kpa and diameter_mm (or radius_mm).

    Example: pneuforce calibrate radius docs/examples/radius.csv --out calibration.toml
    """
    from instrument.cli import calibrate

    typer.echo(calibrate.radius(data, calibrate.Target(out, config)).told(as_json))


@commands.command()
def volume(
    data: Annotated[Path | None, typer.Argument(help="CSV file; without it, the three options.")] = None,
    displaced_ml: Annotated[
        list[float] | None, typer.Option(help="What the syringe held, in mL; once for each stroke.")
    ] = None,
    before_kpa: Annotated[
        list[float] | None, typer.Option(help="Pressure before the stroke, in kPa; once for each.")
    ] = None,
    after_kpa: Annotated[
        list[float] | None, typer.Option(help="Pressure after the stroke, in kPa; once for each.")
    ] = None,
    out: Out = None,
    config: Config = None,
    as_json: Json = False,
) -> None:
    """Volume of the pipes, by a syringe emptied into them: columns syringe_ml (or volume_mm3), pressure_kpa.

    Example: pneuforce calibrate volume docs/examples/volume.csv --out calibration.toml
    """
    from instrument.cli import calibrate

    strokes = (displaced_ml or [], before_kpa or [], after_kpa or [])
    typer.echo(calibrate.volume(data, strokes, calibrate.Target(out, config)).told(as_json))


@commands.command()
def lag(
    data: Data,
    filter_s: Annotated[
        float,
        typer.Option(help="Time constant of the filter that the recording went through, in s.", min=0, max=1),
    ] = 0.0,
    out: Out = None,
    config: Config = None,
    as_json: Json = False,
) -> None:
    """Lag of the tube, from a recorded step of the pressure: columns t_s, pressure_kpa.

    Example: pneuforce calibrate lag docs/examples/lag.csv --out calibration.toml
    """
    from instrument.cli import calibrate

    typer.echo(calibrate.lag(data, filter_s, calibrate.Target(out, config)).told(as_json))


@commands.command()
def force(data: Data, out: Out = None, config: Config = None, as_json: Json = False) -> None:
    """Force against a reference cell: columns initial_kpa, final_kpa, force_n, and force_std_n if known.

    Example: pneuforce calibrate force docs/examples/contacts.csv --out calibration.toml
    """
    from instrument.cli import calibrate

    typer.echo(calibrate.force(data, calibrate.Target(out, config)).told(as_json))


@commands.command()
def contacts(
    plant: Annotated[PlantName, typer.Option(help="Balloon of the simulator.")] = "membrane",
    count: Annotated[int, typer.Option(help="How many contacts.", min=1, max=2000)] = 24,
    seed: Annotated[int, typer.Option(help="Seed of setpoints, forces and noise.", min=0)] = 1,
) -> None:
    """Make reference contacts on the simulated rig, as CSV: something to try `calibrate force` with.

    Example: pneuforce calibrate contacts --count 24 --seed 1 > contacts.csv
    """
    from instrument.cli.reference_contacts import as_csv

    for line in as_csv(plant, count, seed):
        typer.echo(line)
