"""Tests of the hashes of passwords."""

import hashlib

import pytest

from pneuforce.instrument.users.password import MAX_CHARACTERS, NO_PASSWORD, PasswordHash, hash_password

PASSWORD = "correct horse bättery"


def test_a_hash_belongs_to_its_password_only_and_each_hash_has_its_own_salt():
    first, second = hash_password(PASSWORD), hash_password(PASSWORD)
    assert first.matches(PASSWORD)
    assert first.matches(PASSWORD.replace("ä", "a\N{COMBINING DIAERESIS}"))
    assert not first.matches(PASSWORD + " ")
    assert first.salt != second.salt
    assert first.digest != second.digest
    assert (first.cost, first.block_size) == (NO_PASSWORD.cost, NO_PASSWORD.block_size)


def test_the_digest_is_that_of_rfc_7914():
    """RFC 7914, section 12, third test vector; scrypt with a shorter digest has the same first bytes."""
    expected = bytes.fromhex("7023bdcb3afd7348461c06cd81fd38ebfda8fbba904f8e3ea9b543f6545da1f2")
    salt = b"SodiumChloride"
    digest = hashlib.scrypt(b"pleaseletmein", salt=salt, n=16384, r=8, p=1, dklen=64, maxmem=2**26)
    assert digest[:32] == expected
    padded = hashlib.scrypt(b"pleaseletmein", salt=salt.ljust(16), n=16384, r=8, p=1, dklen=32, maxmem=2**26)
    assert PasswordHash(16384, 8, 1, salt.ljust(16), padded).matches("pleaseletmein")


@pytest.mark.parametrize(
    "password", ["", "x" * 11, "x" * (MAX_CHARACTERS + 1), "a new\tpassword", "x" * 12 + "\0"]
)
def test_a_password_that_is_short_long_or_invisible_is_rejected(password):
    with pytest.raises(ValueError, match="password") as caught:
        hash_password(password)
    assert not password or password not in str(caught.value)


def test_no_password_belongs_to_the_hash_of_an_unknown_user():
    assert not NO_PASSWORD.matches("")
