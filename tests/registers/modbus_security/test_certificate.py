"""Tests of the identity in a certificate: role, name and end of validity."""

from datetime import UTC, datetime

import pytest
from cryptography import x509
from cryptography.hazmat.primitives.serialization import Encoding

from pneuforce.instrument.commissioning import certificates
from pneuforce.instrument.commissioning.certificates import new_authority, new_client
from pneuforce.registers.modbus_security.certificate import ROLE_OID, encode_role, identity_of
from pneuforce.support.certificate_days import days_left

NOW = datetime(2030, 1, 1, tzinfo=UTC)
AUTHORITY = new_authority("authority", NOW)


def der(role="operator", name="plc"):
    return new_client(AUTHORITY, name, role, NOW, 10).certificate.public_bytes(Encoding.DER)


def with_extension(monkeypatch, value):
    """Return a certificate whose role extension has any value."""
    monkeypatch.setattr(certificates, "encode_role", lambda _role: value)
    return der()


@pytest.mark.parametrize("role", ["operator", "GridServiceSunSpec", "Prüfer", "x" * 64, ""])
def test_a_role_is_read_as_it_was_written(role):
    assert identity_of(der(role)).role == role


@pytest.mark.parametrize(
    "value",
    [
        b"\x16\x08operator",  # IA5String
        b"\x13\x08operator",  # PrintableString
        b"\x0c\x07operator",
        b"\x0c\x09operator",
        b"\x0c\x81\x08operator",  # DER requires the short form of the length
        b"\x0c\x00",
        b"",
        b"\x0c",
        b"\x0c\x02\xff\xfe",
        b"\x0c\x08opera\x00or",
        b"\x0c\x41" + b"x" * 65,
        b"\x0c\x08operator\x0c\x06viewer",
    ],
)
def test_a_malformed_role_is_no_role(monkeypatch, value):
    assert identity_of(with_extension(monkeypatch, value)).role == ""


def test_two_roles_are_no_role(monkeypatch):
    def doubled(self, extension, critical):
        extensions = [*self._extensions, x509.Extension(extension.oid, critical, extension)]
        if extension.oid == ROLE_OID:
            extensions.append(extensions[-1])
        return x509.CertificateBuilder(
            self._issuer_name,
            self._subject_name,
            self._public_key,
            self._serial_number,
            self._not_valid_before,
            self._not_valid_after,
            extensions,
        )

    monkeypatch.setattr(x509.CertificateBuilder, "add_extension", doubled)
    certificate = der()
    assert certificate.count(b"\x0c\x08operator") == 2
    assert identity_of(certificate).role == ""


@pytest.mark.parametrize("role", ["", "x" * 65, "ü" * 33])
def test_a_role_that_is_too_short_or_too_long_is_rejected(role):
    with pytest.raises(ValueError, match="1 to 64 bytes"):
        encode_role(role)


def test_a_name_has_no_characters_that_could_forge_a_line_of_the_log():
    name = identity_of(der(name="plc\n2030 operator 1.2.3.4 vent\x1b[2J" + "x" * 30)).name
    assert name.isprintable()
    assert name.isascii()
    assert len(name.split(" ")) == 2
    assert len(name) <= 53


def test_two_certificates_with_the_same_name_are_two_peers():
    assert identity_of(der()).name != identity_of(der()).name


def test_the_end_of_validity():
    identity = identity_of(der())
    assert identity.valid_until_s == NOW.timestamp() + 10 * 86_400
    pem = new_client(AUTHORITY, "plc", "", NOW, 10).certificate.public_bytes(Encoding.PEM)
    assert days_left(pem, NOW.timestamp()) == 10


@pytest.mark.parametrize("data", [b"", b"\x30\x00", der()[:-1], b"x" * 500])
def test_what_is_no_certificate_raises_value_error(data):
    with pytest.raises(ValueError):  # noqa: PT011 - the text belongs to the library
        identity_of(data)
