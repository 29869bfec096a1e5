"""Calibration file: the measured values of one balloon and its circuit, each part with date and source."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.calibration.sections import (
    CalibrationPart,
    ForcePart,
    GripPart,
    LagPart,
    RadiusPart,
    VolumePart,
)
from pneuforce.support import atomic_file
from pneuforce.support.atomic_file import read_file
from pneuforce.support.toml_sections import (
    AnySection,
    Section,
    decode_text,
    format_section,
    parse_tables,
    validate_tables,
)

#: Part of each message about a value that is not plausible.
REMEDY = "repeat this part of the calibration, and check units and dates"
_END_MARKER = re.compile(r"^\[end\]\s*^whole\s*=\s*(true|false)", re.MULTILINE)


class EndMarker(Section):
    """End of the file: without this section the file is incomplete."""

    whole: Literal[True] = True


class Calibration(Section):
    """Content of a complete calibration file."""

    version: int = Field(ge=1, le=1)
    balloon_id: int = Field(ge=0, le=0xFFFF_FFFF)
    radius: RadiusPart | None = None
    volume: VolumePart | None = None
    lag: LagPart | None = None
    grip: GripPart | None = None
    force: ForcePart | None = None
    end: EndMarker

    @property
    def parts(self) -> list[CalibrationPart]:
        """Return the parts that the file has."""
        return [
            part for part in (self.radius, self.volume, self.lag, self.grip, self.force) if part is not None
        ]

    @property
    def date_code(self) -> int:
        """Return the date of the newest part as yyyymmdd, 0 if there are no parts."""
        return max((int(f"{part.date:%Y%m%d}") for part in self.parts), default=0)


def empty(balloon_id: int) -> Calibration:
    """Return a calibration without any part."""
    return Calibration(version=1, balloon_id=balloon_id, end=EndMarker())


def load(path: Path) -> Calibration:
    """Return the calibration in a file.

    Raises ConfigurationError, which names the file, and for an invalid value also the key and its range.
    """
    return parse(read_file(path, remedy(path)), str(path))


def remedy(path: Path) -> str:
    """Return how to get a calibration file, for the message about a missing file."""
    return f"pneuforce calibrate force reference-contacts.csv --out {path} creates it"


def parse(content: bytes, name: str) -> Calibration:
    """Return the calibration in the content of the file `name`. Raises ConfigurationError as `load`."""
    text = decode_text(content, name)
    if not _END_MARKER.search(text):
        raise ConfigurationError(
            f"{name}: no complete calibration file: its last lines, [end] and whole = true, are missing"
        )
    return validated(Calibration, parse_tables(text, name), name)


def validated(section: type[AnySection], values: dict[str, Any], name: str) -> AnySection:
    """Return the values as a section. `name` is the file that the values come from.

    Raises ConfigurationError with one line for each value that is not plausible: file, key, value, allowed
    values, and remedy.
    """
    try:
        return validate_tables(section, values, name)
    except ConfigurationError as error:
        lines = [f"{line}; {REMEDY}" for line in str(error).splitlines()]
        raise ConfigurationError("\n".join(lines)) from None


def to_toml(calibration: Calibration) -> str:
    """Return the text of the calibration file."""
    title = "# Written by pneuforce calibrate. Names end in their units; std is a standard uncertainty.\n"
    return f"{title}{format_section(calibration)}\n"


def save(calibration: Calibration, path: Path) -> None:
    """Write the file. An existing file is replaced only when the new file is complete.

    Raises ConfigurationError if the file cannot be written.
    """
    atomic_file.write_lines(path, [to_toml(calibration)])
