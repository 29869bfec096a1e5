"""The commands about the number itself: estimate, budget."""

from __future__ import annotations

from enum import Enum
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
