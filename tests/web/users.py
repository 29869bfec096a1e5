"""Users for tests, whose hashes cost little time."""

import hashlib
from dataclasses import replace

from pneuforce.instrument.users.file import User, write_users
from pneuforce.instrument.users.password import DIGEST_BYTES, SALT_BYTES, PasswordHash

OPERATOR, VIEWER, PASSWORD = "anna", "bob", "correct-horse-battery"
COST, BLOCK_SIZE = 2, 8


def user(name, role="operator", password=PASSWORD):
    """Return a user."""
    salt = name.encode().ljust(SALT_BYTES)
    digest = hashlib.scrypt(password.encode(), salt=salt, n=COST, r=BLOCK_SIZE, p=1, dklen=DIGEST_BYTES)
    return User(name, role, PasswordHash(COST, BLOCK_SIZE, 1, salt, digest))


USERS = {each.name: each for each in (user(OPERATOR), user(VIEWER, "viewer"))}


def users_file(folder, users=USERS):
    """Write a file of users. Return its path as text."""
    path = folder / "users.toml"
    write_users(path, users)
    return str(path)


def with_password(name, password):
    """Return the users after a change of one password."""
    return USERS | {name: replace(USERS[name], password=user(name, password=password).password)}
