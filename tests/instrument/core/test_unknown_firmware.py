"""Tests of the instrument with a firmware that was not released."""

import pytest

from pneuforce.instrument.rig.firmware import Firmware
from tests.instrument.instrument_harness import (
    FOREIGN_FIRMWARE,
    HOLD_8,
    OUR_FIRMWARE,
    VENT,
    InstrumentHarness,
    hello_of,
)

UNREPORTED_FIRMWARE = Firmware(0x100, None)
not_released = pytest.mark.parametrize("firmware", [FOREIGN_FIRMWARE, UNREPORTED_FIRMWARE])


def ready(firmware, **settings):
    harness = InstrumentHarness.ready(**settings)
    harness.instrument.identify_board(hello_of(), firmware)
    return harness


@not_released
def test_maintenance_is_required_and_the_registers_name_the_image(firmware):
    harness = ready(firmware)
    seen = harness.snapshot()
    assert "maintenance_required" in seen.status
    assert (seen.firmware_version, seen.firmware_image) == (firmware.version, firmware.image_crc or 0)
    assert seen.firmware_origin == ("not_reported" if firmware.image_crc is None else "unknown")
    harness.write_ok(HOLD_8)


@not_released
def test_an_inflation_is_rejected_if_a_released_firmware_is_required(firmware):
    harness = ready(firmware, require_released_firmware=True)
    assert harness.write(HOLD_8) == "unknown_firmware"
    harness.write_ok(VENT)
    assert harness.snapshot().state == "vented"


def test_an_inflation_is_rejected_before_the_firmware_is_known():
    assert ready(None, require_released_firmware=True).write(HOLD_8) == "unknown_firmware"


def test_a_released_firmware_inflates_and_needs_no_maintenance():
    harness = ready(OUR_FIRMWARE, require_released_firmware=True)
    harness.write_ok(HOLD_8)
    seen = harness.snapshot()
    assert "maintenance_required" not in seen.status
    assert (seen.firmware_origin, seen.firmware_image) == ("current", OUR_FIRMWARE.image_crc)
