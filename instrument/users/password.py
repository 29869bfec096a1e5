"""Salted hashes of passwords, by scrypt (RFC 7914). A hash needs about 80 ms of one core and 32 MB of memory.

The cost was measured on one core of an AMD EPYC. It limits how fast a person who has stolen the file of the
users can guess passwords. With twice the cost, a login on a busy computer would take noticeably longer.
"""

from __future__ import annotations

import hashlib
import hmac
import secrets
import unicodedata
from dataclasses import dataclass

COST = 2**15
BLOCK_SIZE = 8
PARALLELISM = 1
SALT_BYTES = 16
DIGEST_BYTES = 32
#: Limit for the product of the three parameters in a file: 128 MB and about 0.3 s.
MAX_WORK = 4 * COST * BLOCK_SIZE * PARALLELISM
MAX_MEMORY_BYTES = 128 * MAX_WORK + 2**20
MIN_CHARACTERS = 12
MAX_CHARACTERS = 128


@dataclass(frozen=True, slots=True)
class PasswordHash:
    """Hash of one password, with the parameters of scrypt that were used."""

    cost: int  #: N of scrypt, a power of 2
    block_size: int
    parallelism: int
    salt: bytes
    digest: bytes

    def __post_init__(self) -> None:
        """Raise ValueError if scrypt does not accept the parameters, or would need too much memory."""
        if self.cost < 2 or self.cost & (self.cost - 1):
            raise ValueError("the cost is not a power of 2")
        if self.block_size < BLOCK_SIZE or self.parallelism < 1:
            raise ValueError("block size or parallelism is too small")
        if self.cost * self.block_size * self.parallelism > MAX_WORK:
            raise ValueError("the hash would need too much memory or time")
        if len(self.salt) < SALT_BYTES or len(self.digest) != DIGEST_BYTES:
            raise ValueError("salt or hash is too short")

    def matches(self, password: str) -> bool:
        """Return True if the hash belongs to this password. The time does not depend on the result."""
        return hmac.compare_digest(_digest(password, self), self.digest)


#: Hash that belongs to no password. The check of an unknown user takes as long as that of a known user.
NO_PASSWORD = PasswordHash(COST, BLOCK_SIZE, PARALLELISM, bytes(SALT_BYTES), bytes(DIGEST_BYTES))


def hash_password(password: str) -> PasswordHash:
    """Return the hash of a password with a new salt. Raises ValueError if the password is not allowed."""
    if not MIN_CHARACTERS <= len(password) <= MAX_CHARACTERS:
        raise ValueError(
            f"a password needs {MIN_CHARACTERS} to {MAX_CHARACTERS} characters: short ones are easy to guess"
        )
    if not password.isprintable():
        raise ValueError("the password contains an invisible character, which no keyboard types: remove it")
    salt = secrets.token_bytes(SALT_BYTES)
    empty = PasswordHash(COST, BLOCK_SIZE, PARALLELISM, salt, bytes(DIGEST_BYTES))
    return PasswordHash(COST, BLOCK_SIZE, PARALLELISM, salt, _digest(password, empty))


def _digest(password: str, parameters: PasswordHash) -> bytes:
    """Return the scrypt digest. Unicode is normalized, because systems encode é in different ways."""
    text = unicodedata.normalize("NFC", password).encode("utf-8", "surrogatepass")
    return hashlib.scrypt(
        text,
        salt=parameters.salt,
        n=parameters.cost,
        r=parameters.block_size,
        p=parameters.parallelism,
        maxmem=MAX_MEMORY_BYTES,
        dklen=DIGEST_BYTES,
    )
