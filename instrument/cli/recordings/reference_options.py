"""Group of options for the file of a reference sensor, which has its own clock, columns, unit and sign."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, NamedTuple

import typer

from pneuforce.instrument.cli.terminal.option_groups import given_options, reject_options

if TYPE_CHECKING:
    from pneuforce.instrument.validation.reference_alignment import ReferenceInput


class ReferenceOptions(NamedTuple):
    """Options of the reference force. An option that is not given is None, or False."""

    reference: Annotated[
        Path | None, typer.Option(help="CSV file of the reference force sensor over time.")
    ] = None
    offset: Annotated[
        float | None,
        typer.Option(
            help="With --reference: time of the recording minus time of the reference, in s; estimated by "
            "default."
        ),
    ] = None
    time_column: Annotated[
        str | None, typer.Option(help="With --reference: column of the time, in s.", show_default="t_s")
    ] = None
    force_column: Annotated[
        str | None, typer.Option(help="With --reference: column of the force.", show_default="force_n")
    ] = None
    unit: Annotated[
        Literal["N", "mN", "gf", "g", "kgf", "lbf"] | None,
        typer.Option(help="With --reference: unit of the force.", show_default="N"),
    ] = None
    invert: Annotated[
        bool, typer.Option("--invert", help="With --reference: reverse the sign of the force.")
    ] = False
    tare: Annotated[
        bool, typer.Option("--tare", help="With --reference: subtract the reference force without contact.")
    ] = False

    def input(self) -> ReferenceInput | None:
        """Return the file and how to read it, None if no file is given.

        Raises ConfigurationError if there are options, but no file.
        """
        from pneuforce.instrument.validation.reference import ReferenceColumns
        from pneuforce.instrument.validation.reference_alignment import ReferenceInput

        if self.reference is None:
            reject_options(given_options(self), "with --reference")
            return None
        columns = ReferenceColumns(
            self.time_column or "t_s", self.force_column or "force_n", self.unit or "N", self.invert
        )
        return ReferenceInput(self.reference, columns, self.offset, self.tare)
