"""Tests of the configuration and the calibration that `pneuforce evaluate` uses and names."""

import hashlib
import json
from importlib.metadata import version

import pyarrow.parquet as pq
import pytest

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.cli.recordings.evaluation_settings import EvaluationSettings
from pneuforce.instrument.config import Configuration, load
from pneuforce.instrument.recording.opening import open_recording
from pneuforce.instrument.service.local_socket.stream_header import stream_header
from tests.command_runner import pneuforce
from tests.instrument.recording.virtual_host import write_recording


def test_the_result_names_program_configuration_and_calibration(recording, config, tmp_path):
    checked = json.loads(pneuforce("config", "--check", config, "--json").stdout)
    assert (
        f"configuration hash {checked['configuration_hash']}" in pneuforce("config", "--check", config).stdout
    )
    out = tmp_path / "contacts.parquet"
    facts = json.loads(
        pneuforce("evaluate", recording, "--config", config, "--json", "--contacts", out).stdout
    )
    calibration = config.with_name("calibration.toml")
    expected = {
        "version": version("pneuforce"),
        "configuration_hash": checked["configuration_hash"],
        "calibration": str(calibration),
        "calibration_sha256": hashlib.sha256(calibration.read_bytes()).hexdigest(),
    }
    assert {name: facts[name] for name in expected} == expected
    assert json.loads(pq.read_schema(out).metadata[b"pneuforce.evaluation"]) == expected
    shown = pneuforce("evaluate", recording, "--config", config).stdout.splitlines()[-1]
    assert all(value in shown for value in expected.values())


@pytest.mark.parametrize("calibrated", [False, True])
def test_a_reference_alone_uses_the_configuration_and_the_calibration_of_the_recording(
    entries, config, tmp_path, calibrated
):
    """The instrument recorded with these settings. With them, all forces are the recorded forces."""
    path, configuration = tmp_path / "own.recording", load(config) if calibrated else Configuration()
    header = stream_header(configuration, simulated=True, faults=())
    names = ("configuration", "calibration", "configuration_hash")
    write_recording(entries, path, **{name: header[name] for name in names})
    with open_recording(path) as source:
        settings = EvaluationSettings.of(source, None, None, has_reference=True)
        with pytest.raises(ConfigurationError, match="nothing to evaluate with"):
            EvaluationSettings.of(source, None, None, has_reference=False)
    assert settings.configuration.hash == configuration.hash
    assert settings.configuration.chain == configuration.chain
    assert settings.facts()["configuration_hash"] == header["configuration_hash"]
    assert settings.facts()["calibration"] == (str(path) if calibrated else None)
    assert settings.facts()["calibration_sha256"] is None
