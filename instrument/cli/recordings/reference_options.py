"""Group of options for the file of a reference sensor, which has its own clock, columns, unit and sign."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, NamedTuple

import typer

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.cli.terminal.option_groups import given_options, reject_options

if TYPE_CHECKING:
    from pneuforce.instrument.validation.reference_alignment import ReferenceInput

UTC = "utc"  #: value of --offset for two clocks that show the right time


class ReferenceOptions(NamedTuple):
    """Options of the reference force. An option that is not given is None, or False."""

    reference: Annotated[
        Path | None, typer.Option(help="CSV file of the reference force sensor over time.")
    ] = None
    offset: Annotated[
        str | None,
        typer.Option(
            metavar="S|utc",
            help="With --reference: time of the recording minus time of the reference, in s; estimated by "
            "default. utc: both clocks show the right time, and the reference has the time since 1970.",
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

        Raises ConfigurationError if there are options, but no file, and if the offset is invalid.
        """
        from pneuforce.instrument.validation.reference import ReferenceColumns
        from pneuforce.instrument.validation.reference_alignment import ReferenceInput

        if self.reference is None:
            reject_options(given_options(self), "with --reference")
            return None
        columns = ReferenceColumns(
            self.time_column or "t_s", self.force_column or "force_n", self.unit or "N", self.invert
        )
        return ReferenceInput(self.reference, columns, self._offset_s(), self.tare, self.offset == UTC)

    def _offset_s(self) -> float | None:
        if self.offset is None or self.offset == UTC:
            return None
        try:
            offset_s = float(self.offset)
        except ValueError:
            offset_s = math.nan
        if not math.isfinite(offset_s):
            raise ConfigurationError(
                f"--offset = {self.offset} is invalid: it must be a number of seconds, or {UTC}"
            )
        return offset_s
