"""Options that several commands have."""

from __future__ import annotations

from typing import Annotated, Literal

import typer

from instrument.model import law

PlantName = Literal["published", "membrane"]
Parity = Literal["even", "odd", "none"]

Json = Annotated[bool, typer.Option("--json", help="Machine-readable output.")]
Seconds = Annotated[
    float | None, typer.Option("--seconds", min=0.0, help="End after this time; without it, at Ctrl-C.")
]
Method = Annotated[law.MethodName, typer.Option(help="Force model.")]
Switch = Annotated[
    law.Switch, typer.Option(help="At ΔP_i = 8.85 kPa: the paper's step, or a blend without one.")
]
Low = Annotated[
    law.Low, typer.Option(help="Below a rise of 0.5 kPa: the paper's line to zero, or a smooth join.")
]
