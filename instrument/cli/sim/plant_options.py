"""Options that select the simulated balloon: `--plant`, `--rubber` and `--contact`."""

from __future__ import annotations

from typing import Annotated, Any, Literal, NamedTuple

import typer

from pneuforce.errors import ConfigurationError

PlantName = Literal["published", "membrane"]
RubberName = Literal["mooney-rivlin", "neo-hookean", "gent", "ogden"]

Rubber = Annotated[RubberName | None, typer.Option(help="Rubber of the membrane balloon.")]
Contact = Annotated[
    str | None,
    typer.Option(
        help="Contact of the membrane balloon with the plate: slide (no friction), stick, or a number from 0 "
        "(slide) to 1 (stick).",
        metavar="[slide|stick|0…1]",
    ),
]


class PlantOptions(NamedTuple):
    """Selected simulated balloon. The scenario determines all properties that are None."""

    plant: str | None = None
    rubber: str | None = None
    contact: str | None = None

    def apply(self, table: Any) -> Any:
        """Return the `PlantTable` of a scenario with the selected properties.

        Raises ConfigurationError if a property is invalid, or if the balloon is not a membrane.
        """
        from pydantic import ValidationError

        from pneuforce.sim.scenario import PlantTable
        from pneuforce.support.validation_errors import format_errors

        if self.plant not in (None, table.kind):
            table = PlantTable.model_validate({"kind": self.plant})
        changes: dict[str, Any] = {}
        if self.rubber is not None:
            changes["material"] = self.rubber
        if self.contact is not None:
            changes["contact"] = _number_or_word(self.contact)
        if changes and table.kind != "membrane":
            raise ConfigurationError(
                f"--rubber and --contact describe the membrane balloon, but the balloon is {table.kind}: "
                "use --plant membrane"
            )
        try:
            return PlantTable.model_validate(table.model_dump() | changes)
        except ValidationError as error:
            raise ConfigurationError("; ".join(format_errors(error, PlantTable))) from None


def _number_or_word(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text
