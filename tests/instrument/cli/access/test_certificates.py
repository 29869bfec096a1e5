"""Tests of the failures of `pneuforce certificates`."""

import pytest
from typer.testing import CliRunner

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.cli.app import app


@pytest.mark.parametrize(
    "words",
    [
        ("instrument", "new pki", "--host", "192.168.1.20"),
        ("client", "new pki", "plc"),
        ("revoke", "new pki", "plc.pem"),
    ],
)
def test_a_missing_authority_is_named_with_the_command_that_makes_it(tmp_path, monkeypatch, words):
    monkeypatch.chdir(tmp_path)
    error = CliRunner().invoke(app, ["certificates", *words]).exception
    assert isinstance(error, ConfigurationError)
    assert str(error).startswith("new pki contains no authority")
    assert str(error).endswith("pneuforce certificates authority 'new pki'")
    assert "--host" not in str(error)
