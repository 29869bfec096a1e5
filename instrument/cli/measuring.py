"""The commands about the number itself: estimate, budget, validate, accuracy."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

commands = typer.Typer()


class MethodName(Enum):
    """The force models."""

    ENERGETIC = "energetic"
    LULEVICH = "lulevich"
    SHANAHAN = "shanahan"


class SwitchName(Enum):
    """How the stretching energy changes at 8.85 kPa."""

    PAPER = "paper"
    BLEND = "blend"


class LowName(Enum):
    """How the force goes to zero below a rise of 0.5 kPa."""

    LINE = "line"
    SMOOTH = "smooth"


class PlantName(Enum):
    """The simulated balloons."""

    PUBLISHED = "published"
    MEMBRANE = "membrane"


Json = Annotated[bool, typer.Option("--json", help="Machine-readable output.")]
Dpi = Annotated[float, typer.Option("--dpi", help="Gauge pressure before contact ΔP_i, in kPa.")]
Dpf = Annotated[float, typer.Option("--dpf", help="Gauge pressure in contact ΔP_f, in kPa.")]
Method = Annotated[MethodName, typer.Option(help="Force model.")]
Switch = Annotated[
    SwitchName, typer.Option(help="At ΔP_i = 8.85 kPa: the paper's step, or a blend without one.")
]
Low = Annotated[
    LowName, typer.Option(help="Below a rise of 0.5 kPa: the paper's line to zero, or a smooth join.")
]


@commands.command()
def estimate(
    dpi: Dpi,
    dpf: Dpf,
    method: Method = MethodName.ENERGETIC,
    switch: Switch = SwitchName.PAPER,
    low: Low = LowName.LINE,
    as_json: Json = False,
) -> None:
    """The force of one contact from the pressures before and during it.

    Example: pneuforce estimate --dpi 8.0 --dpf 9.2
    """
    from instrument.cli import estimate
    from instrument.model import Law

    contact = estimate.contact_of(dpi, dpf, Law(method=method.value, switch=switch.value, low=low.value))
    typer.echo(estimate.as_json(contact) if as_json else estimate.report(contact))


@commands.command()
def budget(
    dpi: Dpi,
    dpf: Dpf,
    method: Method = MethodName.ENERGETIC,
    switch: Switch = SwitchName.PAPER,
    low: Low = LowName.LINE,
    as_json: Json = False,
) -> None:
    """Where the uncertainty of that force comes from, input by input.

    Example: pneuforce budget --dpi 8.0 --dpf 9.2
    """
    from instrument.cli import estimate
    from instrument.model import Law

    contact = estimate.contact_of(dpi, dpf, Law(method=method.value, switch=switch.value, low=low.value))
    typer.echo(estimate.budget_json(contact) if as_json else estimate.budget_report(contact))


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
    switch: Switch = SwitchName.PAPER,
    low: Low = LowName.LINE,
    save: Annotated[Path | None, typer.Option(help="Write the recording to this CSV file.")] = None,
    figures: Annotated[Path | None, typer.Option(help="Draw the paper's figures into this folder.")] = None,
    as_json: Json = False,
) -> None:
    """How far the force is from a reference, evaluated as the paper did it and beside its figures.

    Example: pneuforce validate --plant membrane
    """
    from instrument.cli import validate
    from instrument.cli.validation_source import Choice
    from instrument.model import Law

    choice = Choice(data=data, scenario=scenario, plant=plant.value if plant else None, seed=seed)
    validate.validate(choice, Law(switch=switch.value, low=low.value), save, figures, as_json)


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
    from instrument.cli import accuracy

    typer.echo(accuracy.accuracy(contacts, calibrations, seed, as_json))
