"""Tests of the context of a TLS server: renewal of its files, and the days until its certificate expires."""

import logging
import ssl
import time
from datetime import timedelta

import pytest

from pneuforce.instrument.commissioning.certificates import CLOCK_TOLERANCE, certificate_pem
from pneuforce.support.certificate_days import renewal_warning
from pneuforce.support.certificate_purpose import is_server_certificate
from pneuforce.support.renewed_context import RenewedContext
from pneuforce.support.tls_files import TlsFiles
from tests.registers.modbus_security.serving import Pki

DAY_S = 86_400.0


@pytest.fixture
def pki(tmp_path):
    return Pki(tmp_path)


@pytest.fixture
def tls(pki):
    return RenewedContext(TlsFiles(**pki.own), "the web page")


def bad_key(pki):
    (pki.folder / "instrument.key").write_bytes(b"half a file")


def only_the_certificate(pki):
    key = (pki.folder / "instrument.key").read_bytes()
    pki.renew_instrument()
    (pki.folder / "instrument.key").write_bytes(key)


def expired(pki):
    pki.renew_instrument(days=1, age_days=2)


def missing(pki):
    (pki.folder / "instrument.pem").unlink()


def that_of_a_client(pki):
    pki.write("instrument", pki.client("plc", "operator"))


@pytest.mark.parametrize("change", [bad_key, only_the_certificate, expired, missing, that_of_a_client])
def test_files_that_cannot_be_used_are_logged_once_and_the_earlier_ones_stay(tls, pki, caplog, change):
    now_s, context = time.time(), tls.current
    days = tls.certificate_days(now_s)
    change(pki)
    assert [tls.renew(now_s), tls.renew(now_s)] == [set(), set()]
    assert tls.current is context
    assert tls.certificate_days(now_s) == days
    assert len(caplog.messages) == 1
    assert "not used" in caplog.messages[0]
    pki.renew_instrument()
    assert tls.renew(now_s) == {"certificate", "key"}
    assert tls.current is not context


def test_a_certificate_without_a_stated_purpose_is_valid_for_a_server(pki):
    assert is_server_certificate((pki.folder / "ca.pem").read_bytes())
    assert is_server_certificate(b"not a certificate")
    assert not is_server_certificate(certificate_pem(pki.client("plc", "operator").certificate))


def test_an_expired_certificate_is_no_reason_not_to_start(pki):
    pki.renew_instrument(days=1, age_days=2)
    assert RenewedContext(TlsFiles(**pki.own), "the web page").certificate_days(time.time()) < 0


def test_a_certificate_that_is_not_yet_valid_is_used_with_a_warning(pki, caplog):
    pki.renew_instrument(age_days=-2)
    tls = RenewedContext(TlsFiles(**pki.own), "the web page")
    assert tls.certificate_days(time.time()) > 365
    begin = pki.now + timedelta(days=2) - CLOCK_TOLERANCE
    (line,) = caplog.messages
    assert line.startswith("the web page: the certificate is valid from ")
    assert f"{begin:%Y-%m-%d %H:%M} UTC" in line
    pki.renew_instrument(age_days=-4)
    tls.renew(time.time())
    assert ["valid from" in line for line in caplog.messages] == [True, False, True]


def test_the_days_are_those_of_the_certificate_in_use(tls, pki, caplog):
    caplog.set_level(logging.ERROR)
    now_s = time.time()
    assert tls.certificate_days(now_s) == pytest.approx(365, abs=0.01)
    pki.renew_instrument(days=20)
    assert tls.certificate_days(now_s) == pytest.approx(365, abs=0.01)
    tls.renew(now_s)
    assert tls.certificate_days(now_s + DAY_S) == pytest.approx(19, abs=0.01)


@pytest.mark.parametrize(
    ("days", "words"),
    [
        (None, ""),
        (30.0, ""),
        (29.9, "30 days"),
        (1.2, "1 day:"),
        (0.2, "4 hours:"),
        (0.003, "5 minutes:"),
        (-0.1, "has expired"),
    ],
)
def test_a_certificate_must_be_renewed_thirty_days_before_its_end(days, words):
    warning = renewal_warning(days)
    assert words in warning
    assert bool(warning) == bool(words)


def test_only_authorities_make_client_certificates_necessary(tls, pki):
    assert tls.current.verify_mode is ssl.CERT_NONE
    assert pki.files().load().verify_mode is ssl.CERT_REQUIRED
    assert tls.current.minimum_version is ssl.TLSVersion.TLSv1_2


def test_an_empty_name_of_the_authorities_is_an_error(pki):
    with pytest.raises(OSError, match="name of the file is empty"):
        TlsFiles(**pki.own, ca="").load()
