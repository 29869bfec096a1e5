"""The command `pneuforce calibrate contacts`, and the check of its combinations of options."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from pneuforce.instrument.cli.options import Json, Out, Overwrite
from pneuforce.instrument.cli.plant_options import Contact, PlantName, PlantOptions, Rubber

commands = typer.Typer()

RecordingFile = Annotated[
    Path | None, typer.Option("--from", help="A recording, instead of the simulated rig.")
]
ReferenceFile = Annotated[
    Path | None, typer.Option(help="With --from: CSV file of the reference force sensor over time.")
]
Offset = Annotated[
    float | None,
    typer.Option(
        help="With --from: time of the recording minus time of the reference, in s; estimated by default."
    ),
]
TimeColumn = Annotated[
    str | None, typer.Option(help="With --from: column of the time, in s.", show_default="t_s")
]
ForceColumn = Annotated[
    str | None, typer.Option(help="With --from: column of the force.", show_default="force_n")
]
ForceUnit = Annotated[
    Literal["N", "mN", "gf", "kgf", "lbf"] | None,
    typer.Option(help="With --from: unit of the force.", show_default="N"),
]
Tare = Annotated[
    bool, typer.Option("--tare", help="With --from: subtract the reference force without contact.")
]
Plant = Annotated[PlantName | None, typer.Option(help="Simulated balloon.", show_default="membrane")]
Count = Annotated[
    int | None, typer.Option(help="Number of simulated contacts.", min=1, max=2000, show_default="24")
]
Seed = Annotated[
    int | None, typer.Option(help="Seed of setpoints, forces and noise.", min=0, show_default="1")
]


@commands.command()
def contacts(
    recording: RecordingFile = None,
    reference: ReferenceFile = None,
    offset: Offset = None,
    time_column: TimeColumn = None,
    force_column: ForceColumn = None,
    unit: ForceUnit = None,
    tare: Tare = False,
    plant: Plant = None,
    count: Count = None,
    seed: Seed = None,
    rubber: Rubber = None,
    contact: Contact = None,
    out: Out = None,
    overwrite: Overwrite = False,
    as_json: Json = False,
) -> None:
    """Write the contacts for calibrate force: from a recording and a reference force, or simulated.

    With --from, the command finds the contacts in the recording, and pairs the plateau of each contact with
    the force of the reference sensor.

    Example: pneuforce calibrate contacts --from press.recording --reference cell.csv > reference-contacts.csv

    Example: pneuforce calibrate contacts --count 24 --seed 1 > reference-contacts.csv
    """
    from pneuforce.instrument.cli.calibrate_contacts import PairingInput, write_pairing, write_simulated
    from pneuforce.instrument.validation.reference import ReferenceColumns

    simulation = {"plant": plant, "count": count, "seed": seed, "rubber": rubber, "contact": contact}
    columns = {"time-column": time_column, "force-column": force_column, "unit": unit}
    others = {"offset": offset, "reference": reference, "tare": tare or None, "json": as_json or None}
    if recording is None:
        _reject_options({**columns, **others}, "with --from")
        write_simulated(_simulated_lines(simulation), out, overwrite)
        return
    _reject_options(simulation, "without --from")
    _require_reference(reference)
    assert reference is not None
    names = ReferenceColumns(time_column or "t_s", force_column or "force_n", unit or "N")
    given = PairingInput(recording, reference, names, offset, tare)
    raise typer.Exit(write_pairing(given, out, overwrite, as_json))


def _simulated_lines(options: Mapping[str, Any]) -> Iterator[str]:
    from pneuforce.instrument.studies.reference_contacts import as_csv
    from pneuforce.sim.scenario import PlantTable

    plant = PlantOptions(options["plant"] or "membrane", options["rubber"], options["contact"])
    count, seed = options["count"], options["seed"]
    return as_csv(plant.apply(PlantTable()), count or 24, 1 if seed is None else seed)


def _reject_options(options: Mapping[str, Any], when: str) -> None:
    """Raise ConfigurationError if an option is given that is valid only in the other case."""
    from pneuforce.errors import ConfigurationError

    given = [f"--{name}" for name, value in options.items() if value is not None]
    if given:
        raise ConfigurationError(f"{', '.join(given)} can be used only {when}")


def _require_reference(reference: Path | None) -> None:
    from pneuforce.errors import ConfigurationError

    if reference is None:
        raise ConfigurationError(
            "--from needs the force of the reference sensor: name its CSV file with --reference"
        )
