"""Tests of the failures of `pneuforce certificates`."""

import json
from datetime import UTC, datetime, timedelta

import pytest
from typer.testing import CliRunner

from pneuforce.errors import ConfigurationError, UsageError
from pneuforce.instrument.cli.access.certificate_text import show
from pneuforce.instrument.cli.access.certificates import make_authority, make_client, revoke
from pneuforce.instrument.cli.app import app
from pneuforce.instrument.commissioning.certificates import (
    certificate_pem,
    new_authority,
    new_client,
    read_authority,
    read_certificate,
    revocation_dates,
    revocation_list,
)
from tests.registers.modbus_security.serving import Pki

FILES = {"ca": "ca.pem", "certificate": "instrument.pem", "key": "instrument.key", "crl": "crl.pem"}


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
        (1, "(1 hour)"),
        (0, "(5 minutes)"),
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


def test_the_begin_of_a_certificate_is_shown_and_a_certificate_of_the_future_is_named(tmp_path):
    now = datetime.now(UTC)
    authority, file = new_authority("test authority", now), tmp_path / "plc.pem"
    for delay_days, words in ((0, False), (2, True)):
        begin = now + timedelta(days=delay_days)
        file.write_bytes(certificate_pem(new_client(authority, "plc", "operator", begin, 30).certificate))
        text = show(file, as_json=False)
        assert ("check the clock of this computer" in text) == words
        certificate = read_certificate(file)
        assert f"valid from {certificate.not_valid_before_utc:%Y-%m-%d}" in text
        facts = json.loads(show(file, as_json=True))
        assert facts["valid_from"] == certificate.not_valid_before_utc.isoformat()
        assert int(facts["serial_number"], 16) == certificate.serial_number


def test_a_list_of_revoked_certificates_is_shown_with_the_date_of_each_revocation(tmp_path):
    make_authority(tmp_path, "plant")
    early = datetime(2026, 3, 1, tzinfo=UTC)
    authority = read_authority(tmp_path / "ca.pem", tmp_path / "ca.key")
    crl = tmp_path / "crl.pem"
    crl.write_bytes(revocation_list(authority, {0xABC: early}, early))
    make_client(tmp_path, "plc", "operator", 30)
    revoke(tmp_path, tmp_path / "plc.pem")
    number = read_certificate(tmp_path / "plc.pem").serial_number
    dates = revocation_dates(crl.read_bytes())
    assert (set(dates), dates[0xABC]) == ({0xABC, number}, early)
    text = show(crl, as_json=False)
    for words in ("issuer CN=plant", "last update 20", "next update 20", "2 revoked certificates"):
        assert f"{words}" in text
    assert "serial number abc, revoked 2026-03-01" in text
    facts = json.loads(show(crl, as_json=True))
    assert {int(each["serial_number"], 16) for each in facts["revoked"]} == {0xABC, number}
    revoke(tmp_path, tmp_path / "plc.pem")
    assert revocation_dates(crl.read_bytes()) == dates


def test_a_damaged_list_of_revoked_certificates_is_reported(tmp_path):
    file = tmp_path / "crl.pem"
    file.write_text("-----BEGIN X509 CRL-----\nAAAA\n-----END X509 CRL-----\n")
    with pytest.raises(ConfigurationError, match="no valid list of revoked certificates"):
        show(file, as_json=False)


@pytest.mark.parametrize(
    ("days", "words"), [(5.5, "overdue for 5 days"), (0.5, "overdue since today"), (-1, "")]
)
def test_an_overdue_list_of_revoked_certificates_is_marked_with_the_remedy(tmp_path, days, words):
    file = Pki(tmp_path / "pki").write_overdue_list(days)
    text, facts = show(file, as_json=False), json.loads(show(file, as_json=True))
    assert facts["overdue"] == bool(words)
    assert ("rejects all clients over TLS; copy the current list of the authority" in text) == bool(words)
    assert words in text
    configuration = tmp_path / "instrument.toml"
    names = "".join(f'{key} = "pki/{file}"\n' for key, file in FILES.items())
    configuration.write_text(f"[modbus_security]\nenabled = true\n{names}")
    done = CliRunner().invoke(app, ["config", "--check", str(configuration)])
    assert done.exit_code == 0, done.output
    assert ("modbus_security: the list of revoked certificates is overdue" in done.output) == bool(words)


def test_an_empty_list_is_named_as_empty_and_is_not_replaced_by_a_list_without_the_earlier_ones(tmp_path):
    make_authority(tmp_path, "plant")
    make_client(tmp_path, "plc", "operator", 30)
    crl = tmp_path / "crl.pem"
    crl.touch()
    with pytest.raises(ConfigurationError, match=r"crl\.pem is empty: .* copy it again"):
        show(crl, as_json=False)
    with pytest.raises(ConfigurationError, match="the earlier revocations would be lost"):
        revoke(tmp_path, tmp_path / "plc.pem")
    crl.unlink()
    assert "1 revoked certificate" in revoke(tmp_path, tmp_path / "plc.pem")


def test_during_an_exchange_of_the_authority_both_lists_are_shown_and_a_missing_list_is_named(tmp_path):
    pki, new = Pki(tmp_path / "pki"), tmp_path / "new"
    crl = pki.write_overdue_list(-5)
    new.mkdir()
    make_authority(new, "new plant")
    make_client(new, "plc", "operator", 30)
    revoke(new, new / "plc.pem")
    authorities = tmp_path / "pki" / "ca.pem"
    authorities.write_bytes(authorities.read_bytes() + (new / "ca.pem").read_bytes())
    configuration = tmp_path / "instrument.toml"
    names = "".join(f'{key} = "pki/{file}"\n' for key, file in FILES.items())
    configuration.write_text(f"[modbus_security]\nenabled = true\n{names}")
    missing = "no list of the authority CN=new plant"
    assert missing in CliRunner().invoke(app, ["config", "--check", str(configuration)]).output
    crl.write_bytes(crl.read_bytes() + (new / "crl.pem").read_bytes())
    assert missing not in CliRunner().invoke(app, ["config", "--check", str(configuration)]).output
    assert show(crl, as_json=False).count("issuer CN=") == 2
    [further] = json.loads(show(crl, as_json=True))["further_lists"]
    assert (further["issuer"], len(further["revoked"])) == ("CN=new plant", 1)
    (new / "crl.pem").write_bytes(crl.read_bytes())
    with pytest.raises(ConfigurationError, match="list of another authority, which would be lost"):
        revoke(new, new / "plc.pem")
    assert (new / "crl.pem").read_bytes() == crl.read_bytes()


def test_a_certificate_of_another_authority_with_the_same_name_is_not_revoked(tmp_path):
    for folder in (tmp_path / "one", tmp_path / "other"):
        folder.mkdir()
        make_authority(folder, "plant")
        make_client(folder, "plc", "operator", 30)
    with pytest.raises(UsageError, match="was not signed by"):
        revoke(tmp_path / "one", tmp_path / "other" / "plc.pem")
