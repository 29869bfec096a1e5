"""Options that several commands share."""

from __future__ import annotations

from typing import Annotated, Literal

import typer

from pneuforce.instrument.model import law

Parity = Literal["even", "odd", "none"]

Json = Annotated[bool, typer.Option("--json", help="Print JSON, for programs.")]
Seconds = Annotated[
    float | None,
    typer.Option("--seconds", min=0.0, help="End after this time, in s; by default, end at Ctrl-C."),
]
Method = Annotated[law.MethodName, typer.Option(help="Force model.")]
Switch = Annotated[
    law.Switch,
    typer.Option(help="Force at ΔP_i = 8.85 kPa: the step of the paper, or a blend without a step."),
]
Low = Annotated[
    law.Low,
    typer.Option(help="Force below a rise of 0.5 kPa: the paper's straight line to zero, or a smooth join."),
]
