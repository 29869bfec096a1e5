"""Tests of the failures of `pneuforce certificates`."""

from datetime import UTC, datetime, timedelta

import pytest
from typer.testing import CliRunner

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.cli.access.certificates import show
from pneuforce.instrument.cli.app import app
from pneuforce.instrument.commissioning.certificates import certificate_pem, new_authority, new_client


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


@pytest.mark.parametrize(
    ("hours", "text"),
    [
        (50, "(2 days)"),
        (25, "(1 day)"),
        (1, "(0 days)"),
        (-1, "(expired today)"),
        (-25, "(expired 1 day ago)"),
        (-50, "(expired 2 days ago)"),
    ],
)
def test_the_time_until_or_since_the_end_is_shown_in_words(tmp_path, hours, text):
    now = datetime.now(UTC)
    authority = new_authority("test authority", now)
    begin = now - timedelta(days=30) + timedelta(hours=hours, minutes=5)
    file = tmp_path / "plc.pem"
    file.write_bytes(certificate_pem(new_client(authority, "plc", "operator", begin, 30).certificate))
    assert show(file, as_json=False).endswith(text)
