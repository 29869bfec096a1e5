"""Options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from pneuforce.instrument.model import law

Parity = Literal["even", "odd", "none"]

Json = Annotated[bool, typer.Option("--json", help="Print JSON, for programs.")]
Seconds = Annotated[
    float | None,
    typer.Option("--seconds", min=0.0, help="End after this time, in s; by default, end at Ctrl-C."),
]
Switch = Annotated[
    law.Switch | None,
    typer.Option(
        help="Force at ΔP_i = 8.85 kPa: the step of the paper, or a blend without a step.",
        show_default="paper",
    ),
]
Low = Annotated[
    law.Low | None,
    typer.Option(
        help="Force below a rise of 0.5 kPa: the paper's straight line to zero, or a smooth join.",
        show_default="line",
    ),
]
InstrumentConfig = Annotated[
    Path | None,
    typer.Option(
        "--config", help="The instrument.toml: use its balloon, circuit, method, law and calibration."
    ),
]
Out = Annotated[
    Path | None, typer.Option("--out", "-o", help="Write the result to this file, instead of the terminal.")
]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace an output file that exists.")]
