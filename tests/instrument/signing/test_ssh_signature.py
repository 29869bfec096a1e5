"""Tests of signature files: signatures of ssh-keygen are accepted, and nothing else."""

import base64

import pytest

from pneuforce.instrument.signing.ssh_signature import decode_public_key, decode_signature, fingerprint
from tests.instrument.signing.keys import make_key, sign, ssh_keygen
from tests.tools import needs

pytestmark = needs("openssh-client", "/usr/bin/ssh-keygen")
CONTENT = b"[balloon]\nid = 7\n"


@pytest.fixture(scope="module")
def key(tmp_path_factory):
    return make_key(tmp_path_factory.mktemp("key") / "lab")


@pytest.fixture(scope="module")
def armored(key):
    return sign(CONTENT, key)


@pytest.mark.parametrize("content", [CONTENT, b"", b"\xff\x00" * 70_000])
@pytest.mark.parametrize("hash_name", ["sha256", "sha512"])
def test_a_signature_of_ssh_keygen_matches_only_its_content(key, content, hash_name):
    signature = decode_signature(sign(content, key, "pneuforce", "-O", f"hashalg={hash_name}"))
    assert signature.hash_name == hash_name.encode()
    assert signature.matches(content)
    assert not signature.matches(content + b"\n")


def test_the_fingerprint_is_that_of_ssh_keygen(key):
    blob = base64.b64decode((key.parent / "lab.pub").read_text().split()[1])
    printed = ssh_keygen("-l", "-f", key.parent / "lab.pub").decode().split()[1]
    assert fingerprint(decode_public_key(blob)) == printed


def test_each_flipped_bit_is_detected(armored):
    """Each byte of the binary signature is changed once."""
    body = base64.b64decode(b"".join(armored.split(b"-----")[2].split()))
    accepted = []
    for index in range(len(body)):
        changed = bytearray(body)
        changed[index] ^= 1
        try:
            if decode_signature(armor(bytes(changed))).matches(CONTENT):
                accepted.append(index)
        except ValueError:
            pass
    assert accepted == []
    assert decode_signature(armor(body)).matches(CONTENT)


def test_each_truncation_is_malformed(armored):
    body = base64.b64decode(b"".join(armored.split(b"-----")[2].split()))
    for length in range(len(body)):
        with pytest.raises(ValueError, match=r"it|its"):
            decode_signature(armor(body[:length]))
    for length in range(len(armored.strip())):
        with pytest.raises(ValueError, match=r"it|its"):
            decode_signature(armored[:length])


def test_a_signature_for_another_purpose_is_refused(key):
    with pytest.raises(ValueError, match="another purpose"):
        decode_signature(sign(CONTENT, key, "git"))


@pytest.mark.parametrize("kind", ["rsa", "ecdsa"])
def test_other_types_of_keys_are_refused(tmp_path, kind):
    with pytest.raises(ValueError, match="ssh-ed25519"):
        decode_signature(sign(CONTENT, make_key(tmp_path / kind, kind)))


@pytest.mark.parametrize("armored", [b"", b"-----BEGIN SSH SIGNATURE-----", b"text", b"\x00" * 4096, b"\xff"])
def test_other_content_is_refused(armored):
    with pytest.raises(ValueError, match="it"):
        decode_signature(armored)


def armor(body):
    return b"-----BEGIN SSH SIGNATURE-----\n" + base64.b64encode(body) + b"\n-----END SSH SIGNATURE-----\n"
