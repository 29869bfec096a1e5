"""Tests of the lines of `pneuforce status`."""

import pytest

from pneuforce.client.details import Details
from pneuforce.client.measurement import Measurement
from pneuforce.instrument.cli.status import lines


@pytest.mark.parametrize(
    ("details", "text"),
    [
        (
            Details(firmware_version=0x102, firmware_origin="unknown", firmware_image=0xDEADBEEF),
            "1.2, image DEADBEEF: The image on the board is not a released image",
        ),
        (
            Details(firmware_version=0x102, firmware_origin="current", firmware_image=0x12),
            "1.2, image 00000012: The board has the firmware of the package",
        ),
        (Details(firmware_version=0, firmware_origin="not_reported", firmware_image=0), "No board has"),
        (Details(), "unknown"),  # raw CAN does not transmit the firmware
    ],
)
def test_the_firmware_is_named_with_its_origin(details, text):
    assert dict(lines(Measurement(), details, "tcp://127.0.0.1:5020?unit=1"))["firmware"].startswith(text)
