"""The command `pneuforce calibrate contacts`, and the check of its combinations of options."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from pneuforce.instrument.cli.recordings.reference_options import ReferenceOptions
from pneuforce.instrument.cli.sim.plant_options import Contact, PlantName, PlantOptions, Rubber
from pneuforce.instrument.cli.terminal.option_groups import expand_options, given_options, reject_options
from pneuforce.instrument.cli.terminal.options import FromS, Json, Out, Overwrite, ToS, span

commands = typer.Typer()

RecordingFile = Annotated[
    Path | None, typer.Option("--from", help="A recording, instead of the simulated rig.")
]
Plant = Annotated[PlantName | None, typer.Option(help="Simulated balloon.", show_default="membrane")]
Count = Annotated[
    int | None, typer.Option(help="Number of simulated contacts.", min=1, max=2000, show_default="24")
]
Seed = Annotated[
    int | None, typer.Option(help="Seed of setpoints, forces and noise.", min=0, show_default="1")
]


@commands.command()
@expand_options
def contacts(
    recording: RecordingFile = None,
    from_s: FromS = None,
    to_s: ToS = None,
    *,
    reference: ReferenceOptions,
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
    from pneuforce.errors import ConfigurationError
    from pneuforce.instrument.cli.calibrate.contacts import PairingInput, write_pairing, write_simulated

    simulation = {"plant": plant, "count": count, "seed": seed, "rubber": rubber, "contact": contact}
    if recording is None:
        times = [name for name, value in (("--from-s", from_s), ("--to-s", to_s)) if value is not None]
        flags = ["--json"] if as_json else []
        reject_options([*given_options(reference), *times, *flags], "with --from")
        write_simulated(_simulated_lines(simulation), out, overwrite)
        return
    reject_options([f"--{name}" for name, value in simulation.items() if value is not None], "without --from")
    given = reference.input()
    if given is None:
        raise ConfigurationError(
            "--from needs the force of the reference sensor: name its CSV file with --reference"
        )
    raise typer.Exit(
        write_pairing(PairingInput(recording, given, *span(from_s, to_s)), out, overwrite, as_json)
    )


def _simulated_lines(options: Mapping[str, Any]) -> Iterator[str]:
    from pneuforce.instrument.studies.reference_contacts import as_csv
    from pneuforce.sim.scenario import PlantTable

    plant = PlantOptions(options["plant"] or "membrane", options["rubber"], options["contact"])
    count, seed = options["count"], options["seed"]
    return as_csv(plant.apply(PlantTable()), count or 24, 1 if seed is None else seed)
