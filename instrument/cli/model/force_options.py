"""Groups of options for an estimate of the force: the pressures, and the force model."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, NamedTuple

import typer

from pneuforce.instrument.cli.terminal.options import InstrumentConfig, Low, Out, Overwrite, Switch
from pneuforce.instrument.model import law
from pneuforce.instrument.model.uncertainty_budget import CONTACT_S


class EstimateInput(NamedTuple):
    """Pressures of one contact or file with the pressures of many contacts, and the output file."""

    dpi: Annotated[
        float | None, typer.Option("--dpi", help="Gauge pressure before the contact, ΔP_i, in kPa.")
    ] = None
    dpf: Annotated[
        float | None, typer.Option("--dpf", help="Gauge pressure during the contact, ΔP_f, in kPa.")
    ] = None
    contacts: Annotated[
        Path | None,
        typer.Option(
            "--csv",
            help="CSV file with one contact per line, instead of --dpi and --dpf: columns baseline_kpa and "
            "final_kpa. /dev/stdin reads from a pipe.",
        ),
    ] = None
    contact_s: Annotated[
        float,
        typer.Option(
            help="Time since the contact began, in seconds. In the first second, heat of the compressed gas "
            "adds to the uncertainty.",
            min=0,
        ),
    ] = CONTACT_S
    out: Out = None
    overwrite: Overwrite = False


class ForceOptions(NamedTuple):
    """Options that select the force model. An option that is not given is None."""

    config: InstrumentConfig = None
    method: Annotated[law.MethodName | None, typer.Option(help="Force model.", show_default="energetic")] = (
        None
    )
    switch: Switch = None
    low: Low = None
    grip: Annotated[
        float | None,
        typer.Option(
            help="Grip of the contact, method membrane: 0 if the skin slides, 1 if it sticks.",
            min=0,
            max=1,
        ),
    ] = None
    grip_std: Annotated[
        float | None,
        typer.Option(
            help="Standard uncertainty of the grip; by default, that of an unknown grip.", min=0, max=1
        ),
    ] = None
    pressed_sides: Annotated[
        int | None,
        typer.Option(
            help="Number of sides on which the balloon is pressed, method membrane.",
            min=1,
            max=2,
            show_default="1",
        ),
    ] = None
    calibration: Annotated[
        Path | None,
        typer.Option(
            "--calibration",
            help="Calibration file of the balloon; by default, that of the paper. The method and its "
            "variants are those of its force calibration. If it has a grip but no force, state --method.",
        ),
    ] = None
