"""The commands about the force itself, and their help: estimate, budget, validate, accuracy."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from instrument.cli import estimate
from instrument.cli.options import Json, Low, Method, PlantName, Switch
from instrument.model import Law

commands = typer.Typer()

Answer = Callable[[estimate.Contact], str]

Dpi = Annotated[float, typer.Option("--dpi", help="Gauge pressure before contact ΔP_i, in kPa.")]
Dpf = Annotated[float, typer.Option("--dpf", help="Gauge pressure in contact ΔP_f, in kPa.")]


def _about_one_contact(name: str, what: str, text: Answer, as_json_text: Answer) -> None:
    """A command that answers about one contact, in text or as JSON."""

    def command(
        dpi: Dpi,
        dpf: Dpf,
        method: Method = "energetic",
        switch: Switch = "paper",
        low: Low = "line",
        as_json: Json = False,
    ) -> None:
        contact = estimate.contact_of(dpi, dpf, Law(method=method, switch=switch, low=low))
        typer.echo((as_json_text if as_json else text)(contact))

    example = f"Example: pneuforce {name} --dpi 8.0 --dpf 9.2"
    commands.command(name, help=f"{what}\n\n{example}")(command)


_about_one_contact(
    "estimate",
    "The force of one contact from the pressures before and during it.",
    estimate.report,
    estimate.as_json,
)
_about_one_contact(
    "budget",
    "Where the uncertainty of that force comes from, input by input.",
    estimate.budget_report,
    estimate.budget_json,
)


@commands.command()
def validate(
    data: Annotated[
        Path | None, typer.Option(help="A recording with a reference force, instead of the simulated rig.")
    ] = None,
    scenario: Annotated[
        str | None, typer.Option(help="What is simulated, campaign by default; see pneuforce sim --list.")
    ] = None,
    plant: Annotated[
        PlantName | None, typer.Option(help="The simulated balloon, instead of the scenario's.")
    ] = None,
    seed: Annotated[
        int | None, typer.Option(help="Seed of the noise, instead of the scenario's.", min=0, max=0xFFFF_FFFF)
    ] = None,
    switch: Switch = "paper",
    low: Low = "line",
    save: Annotated[Path | None, typer.Option(help="Write the recording to this CSV file.")] = None,
    figures: Annotated[Path | None, typer.Option(help="Draw the paper's figures into this folder.")] = None,
    as_json: Json = False,
) -> None:
    """How far the force is from a reference, evaluated as the paper did it and beside its figures.

    Example: pneuforce validate --plant membrane
    """
    from instrument.cli import validate
    from instrument.cli.validation_source import Choice

    choice = Choice(data=data, scenario=scenario, plant=plant, seed=seed)
    validate.validate(choice, Law(switch=switch, low=low), save, figures, as_json)


@commands.command()
def accuracy(
    contacts: Annotated[int, typer.Option(help="Contacts on which is judged.", min=30, max=5000)] = 480,
    calibrations: Annotated[
        int, typer.Option(help="Calibrations of 24 contacts that are averaged.", min=1, max=50)
    ] = 8,
    seed: Annotated[int, typer.Option(help="Seed of the contacts and of their noise.", min=0)] = 1,
    as_json: Json = False,
) -> None:
    """Each estimator against the truth of both simulated balloons, as the page docs/accuracy.md.

    Takes some minutes. Example: pneuforce accuracy > docs/accuracy.md
    """
    from instrument.cli.accuracy import accuracy
    from instrument.cli.accuracy_page import Campaign

    typer.echo(accuracy(Campaign(contacts, calibrations, seed), as_json))
