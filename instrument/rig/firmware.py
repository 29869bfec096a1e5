"""Firmware of the board: its version and the CRC of its image, compared with the released images."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum, auto

from pneuforce.protocol.firmware_images import IMAGES
from pneuforce.protocol.firmware_version import format_version

CURRENT_VERSION = max(IMAGES)  #: version of the firmware in this package
REMEDY = "install the firmware of this package: pneuforce flash"


class FirmwareOrigin(StrEnum):
    """Result of the comparison with the released images."""

    NOT_REPORTED = auto()  #: no board has answered, or its firmware reports no image
    CURRENT = auto()  #: the image of this package
    OTHER_VERSION = auto()  #: a released image of another version
    UNKNOWN = auto()  #: not a released image: a private build, or a damaged flash


@dataclass(frozen=True, slots=True)
class Firmware:
    """Firmware as the board reports it."""

    version: int  #: major · 256 + minor
    image_crc: int | None  #: CRC-32 of the program in the flash; None if the board does not report it

    @property
    def origin(self) -> FirmwareOrigin:
        """Return the result of the comparison with the released images."""
        if self.image_crc is None:
            return FirmwareOrigin.NOT_REPORTED
        if self.image_crc != IMAGES.get(self.version):
            return FirmwareOrigin.UNKNOWN
        is_current = self.version == CURRENT_VERSION
        return FirmwareOrigin.CURRENT if is_current else FirmwareOrigin.OTHER_VERSION

    @property
    def is_released(self) -> bool:
        """Return True if the image is a released image."""
        return self.origin in (FirmwareOrigin.CURRENT, FirmwareOrigin.OTHER_VERSION)

    def __str__(self) -> str:
        """Return the version and the image, and the origin if it is not the image of this package."""
        image = "no image reported" if self.image_crc is None else f"image {self.image_crc:08X}"
        return f"firmware {format_version(self.version)}, {image}{self._remark}"

    @property
    def _remark(self) -> str:
        return {
            FirmwareOrigin.NOT_REPORTED: ": it cannot be compared with the released images",
            FirmwareOrigin.CURRENT: "",
            FirmwareOrigin.OTHER_VERSION: f": this package contains {format_version(CURRENT_VERSION)}",
            FirmwareOrigin.UNKNOWN: ": the image on the board is not a released image",
        }[self.origin]
