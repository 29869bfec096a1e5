"""Settings of the force that the selected force model does not use."""

from __future__ import annotations

from pneuforce.instrument.calibration.apply import is_grip_unused
from pneuforce.instrument.calibration.file import Calibration
from pneuforce.instrument.config.sections import MeasurementSection


def unused_settings(measurement: MeasurementSection, calibration: Calibration | None) -> list[str]:
    """Return a sentence for the settings that the method does not use.

    A value that equals the default counts as not configured.
    """
    method, default = measurement.method, MeasurementSection()
    keys = ("switch", "low") if method == "membrane" else ("grip", "grip_std")
    changed = [f"measurement.{key}" for key in keys if getattr(measurement, key) != getattr(default, key)]
    unused = [" and ".join(changed)] if changed else []
    if calibration is not None and is_grip_unused(method, calibration):
        unused.append('the grip of the calibration file (to use the grip: measurement.method = "membrane")')
    return [f'measurement.method = "{method}" does not use {each}' for each in unused]
