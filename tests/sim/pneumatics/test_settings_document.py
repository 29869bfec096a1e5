"""Tests that the settings in docs/simulator.md agree with the code."""

import re
from dataclasses import fields
from pathlib import Path

import pytest

from pneuforce.sim.pneumatics import PneumaticSettings
from pneuforce.sim.sensor import SensorSettings

DOCUMENT = Path(__file__).parents[3] / "docs" / "simulator.md"
ROW = re.compile(r"^\| (`[^|]+`) \| ([^|]+) \|", re.MULTILINE)


def documented():
    section = (
        DOCUMENT.read_text(encoding="utf-8").partition("## Pneumatics and sensor")[2].partition("\n## ")[0]
    )
    for names, values in ROW.findall(section):
        yield from zip(re.findall("`(.+?)`", names), map(float, values.split(", ")), strict=True)


def test_the_document_has_every_setting_and_no_other():
    declared = [f.name for settings in (PneumaticSettings, SensorSettings) for f in fields(settings)]
    assert [name for name, _ in documented()] == declared


@pytest.mark.parametrize("settings", [PneumaticSettings(), SensorSettings()])
def test_the_document_has_the_defaults(settings):
    defaults = dict(documented())
    assert {f.name: defaults[f.name] for f in fields(settings)} == {
        f.name: getattr(settings, f.name) for f in fields(settings)
    }
