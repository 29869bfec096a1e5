"""Tests of the comparison of the board's firmware with the released images."""

import pytest

from pneuforce.instrument.rig import firmware as module
from pneuforce.instrument.rig.firmware import CURRENT_VERSION, Firmware, FirmwareOrigin
from pneuforce.protocol.firmware_images import IMAGES

OURS = IMAGES[CURRENT_VERSION]


@pytest.fixture
def older_image(monkeypatch):
    """Add an image of version 0.9 to the released images."""
    monkeypatch.setattr(module, "IMAGES", {0x0009: 0x1234, **IMAGES})


@pytest.mark.parametrize(
    ("version", "crc", "origin", "text"),
    [
        (CURRENT_VERSION, OURS, FirmwareOrigin.CURRENT, f"image {OURS:08X}"),
        (0x0009, 0x1234, FirmwareOrigin.OTHER_VERSION, "firmware 0.9, image 00001234: this package contains"),
        (0x0009, OURS, FirmwareOrigin.UNKNOWN, "not a released image"),
        (CURRENT_VERSION, 0x1234, FirmwareOrigin.UNKNOWN, "not a released image"),
        (CURRENT_VERSION, OURS ^ 1, FirmwareOrigin.UNKNOWN, f"image {OURS ^ 1:08X}: the image on the board"),
        (CURRENT_VERSION, None, FirmwareOrigin.NOT_REPORTED, "no image reported"),
    ],
)
def test_version_and_image_are_compared_with_the_released_images(older_image, version, crc, origin, text):
    firmware = Firmware(version, crc)
    assert firmware.origin is origin
    assert firmware.is_released == (origin in (FirmwareOrigin.CURRENT, FirmwareOrigin.OTHER_VERSION))
    assert text in str(firmware)
