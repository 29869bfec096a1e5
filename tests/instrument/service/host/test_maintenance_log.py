"""Tests of the lines about causes of maintenance."""

import logging

import pytest

from pneuforce.instrument.core.controller import Instrument
from pneuforce.instrument.core.settings import Settings
from pneuforce.instrument.service.host.maintenance_log import MaintenanceLog
from pneuforce.registers.advice import MAINTENANCE_ADVICE


def test_a_leak_is_logged_at_its_begin_and_at_its_end(caplog):
    caplog.set_level(logging.INFO)
    instrument = Instrument(Settings())
    lines = MaintenanceLog(instrument)
    for now_s, detected in enumerate((False, True, True, False, False)):
        instrument.chain.leak.detected = detected
        lines.tick(float(now_s))
    assert [record.levelname for record in caplog.records] == ["WARNING", "INFO"]
    assert "doctor" in caplog.records[0].message


def test_a_missing_ambient_pressure_is_logged_until_it_is_written(caplog):
    caplog.set_level(logging.INFO)
    instrument = Instrument(Settings(ambient_required=True, ambient_timeout_s=60.0))
    lines = MaintenanceLog(instrument)
    lines.tick(0.0)
    instrument.requested.ambient_kpa, instrument.requested.ambient_written_s = 101.0, 1.0
    for now_s in (1.0, 60.0, 62.0):
        lines.tick(now_s)
    assert [record.levelname for record in caplog.records] == ["WARNING", "INFO", "WARNING"]
    assert "register 556" in caplog.records[0].message


@pytest.mark.parametrize(
    ("flag", "cause"),
    [
        ("log_down", "event_log_failed"),
        ("recording_down", "recording_failed"),
        ("certificate_expiring", "certificate_expiring"),
    ],
)
def test_a_failure_of_the_computer_is_logged_with_its_remedy_and_its_end(caplog, flag, cause):
    caplog.set_level(logging.INFO)
    instrument = Instrument(Settings())
    lines = MaintenanceLog(instrument)
    for now_s, failed in enumerate((True, True, False)):
        setattr(instrument, flag, failed)
        lines.tick(float(now_s))
    begin, end = (record.message for record in caplog.records)
    assert begin == "maintenance required: {0.what} {0.do}".format(MAINTENANCE_ADVICE[cause])
    assert end.startswith("maintenance: ")
