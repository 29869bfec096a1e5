"""Options that several commands share."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Literal

import typer

from pneuforce.instrument.model import law
from pneuforce.support.network_name import is_host
from pneuforce.support.user_part import without_user

#: For files of the service. An unreadable file is an invalid configuration, not a wrong option: systemd must
#: not start the instrument again.
CHECKED_LATER = False

Parity = Literal["even", "odd", "none"]

Json = Annotated[bool, typer.Option("--json", help="Print JSON, for programs.")]
Seconds = Annotated[
    float | None,
    typer.Option("--seconds", min=0.0, help="End after this time, in s; by default, end at Ctrl-C."),
]
FromS = Annotated[
    float | None,
    typer.Option("--from-s", min=0.0, help="Start at this time after the start of the recording, in s."),
]
ToS = Annotated[
    float | None,
    typer.Option("--to-s", min=0.0, help="End at this time after the start of the recording, in s."),
]
RequireSignedBy = Annotated[
    Path | None,
    typer.Option(
        help="Refuse a configuration or a calibration that no key in this file of trusted keys has signed.",
        metavar="TRUSTED-KEYS",
        readable=CHECKED_LATER,
    ),
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


def checked_host(host: str | None) -> str | None:
    """Return `host`. Raises BadParameter if it is neither an IP address nor a host name.

    A part of the text before an @ is not repeated, because it can contain a password.
    """
    if host is None or is_host(host):
        return host
    raise typer.BadParameter(f"{without_user(host)} is neither an IP address nor a host name")


def span(from_s: float | None, to_s: float | None) -> tuple[float, float]:
    """Return a time range [s]. A missing start is minus infinity, a missing end is infinity."""
    return -math.inf if from_s is None else from_s, math.inf if to_s is None else to_s
