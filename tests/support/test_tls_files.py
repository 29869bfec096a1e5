"""Tests that the message about unusable TLS files names the file that is wrong, and what it must contain."""

import pytest

from pneuforce.support.client_tls import client_context
from pneuforce.support.tls_files import TlsFiles
from tests.registers.modbus_security.serving import Pki

BROKEN = "-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----\n"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("tls")
    Pki(folder / "pki")
    Pki(folder / "other")
    (folder / "junk.pem").write_text("junk\n")
    (folder / "empty.pem").touch()
    (folder / "broken.pem").write_text(BROKEN)
    (folder / "half.pem").write_text((folder / "pki/ca.pem").read_text() + BROKEN)
    return folder


@pytest.mark.parametrize(
    ("changed", "wrong"),
    [
        ({"certificate": "junk.pem"}, "junk.pem contains no valid certificate"),
        ({"certificate": "broken.pem"}, "broken.pem contains no valid certificate"),
        ({"certificate": "half.pem", "key": "pki/ca.key"}, "half.pem contains an invalid certificate"),
        ({"certificate": "pki/instrument.key"}, "pki/instrument.key contains no valid certificate"),
        ({"key": "junk.pem"}, "junk.pem contains no valid private key"),
        ({"key": "pki/instrument.pem"}, "pki/instrument.pem contains no valid private key"),
        ({"key": "other/instrument.key"}, "other/instrument.key is not the key of the certificate"),
        ({"ca": "junk.pem"}, "junk.pem contains no valid certificate"),
        ({"ca": "half.pem"}, "half.pem contains no valid certificate"),
        ({"crl": "empty.pem"}, "empty.pem is empty: copy it again"),
        ({"crl": "junk.pem"}, "junk.pem contains no valid list of revoked certificates"),
        ({"crl": "pki/ca.pem"}, "pki/ca.pem contains no list of revoked certificates"),
        ({"crl": "other/ca.pem"}, "other/ca.pem contains no list of revoked certificates"),
    ],
)
def test_the_message_names_the_file_that_is_wrong(folder, changed, wrong):
    names = {"certificate": "pki/instrument.pem", "key": "pki/instrument.key", "ca": "pki/ca.pem"} | changed
    files = {name: str(folder / file) for name, file in names.items()}
    with pytest.raises(OSError, match=str(folder / wrong)) as caught:
        TlsFiles(**files).load()
    assert "_ssl.c" not in str(caught.value)
    if changed.keys() & {"certificate", "key"}:
        with pytest.raises(OSError, match=str(folder / wrong)):
            client_context(files["ca"], files["certificate"], files["key"])
