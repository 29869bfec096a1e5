"""Tests of the file of the users: content, permissions, and sentences about a damaged file."""

import os
import stat

import pytest

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.users.file import (
    MAX_USERS,
    format_users,
    load_users,
    parse_users,
    write_users,
)
from tests.web.users import OPERATOR, USERS, user

TEXT = format_users(USERS)


def test_users_are_read_as_they_were_written_and_the_file_is_private(tmp_path):
    path = tmp_path / "users.toml"
    assert load_users(path) == {}
    old_umask = os.umask(0)
    try:
        write_users(path, USERS)
    finally:
        os.umask(old_umask)
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert load_users(path) == USERS
    assert os.listdir(tmp_path) == [path.name]


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can change the owner of a file")
def test_the_file_that_root_writes_belongs_to_the_owner_of_the_folder_and_keeps_its_owner(tmp_path):
    path = tmp_path / "users.toml"
    os.chown(tmp_path, 1234, 1235)
    write_users(path, USERS)
    assert (path.stat().st_uid, path.stat().st_gid) == (1234, 1235)
    os.chown(path, 2345, 2346)
    write_users(path, {})
    assert (path.stat().st_uid, path.stat().st_gid) == (2345, 2346)


def test_a_user_is_written_in_words_that_a_person_can_read():
    assert f'[users."{OPERATOR}"]\nrole = "operator"\nscrypt_n = 2\n' in TEXT
    assert parse_users(TEXT.replace('"operator"', '"viewer"'))[OPERATOR].role == "viewer"


DAMAGED = {
    "cut": TEXT[:-10],
    "no table": "users = 1",
    "another table": TEXT + "[others]\n",
    "user without a table": "[users]\nanna = 1",
    "name": TEXT.replace("anna", "Anna"),
    "name with a line": TEXT.replace("anna", "an\\nna"),
    "long name": TEXT.replace("anna", "a" * 33),
    "role": TEXT.replace('"operator"', '"admin"'),
    "role of another type": TEXT.replace('"operator"', "[]"),
    "missing key": TEXT.replace("scrypt_p = 1\n", ""),
    "unknown key": TEXT.replace("scrypt_p", "x = 1\nscrypt_p"),
    "cost of another type": TEXT.replace("scrypt_n = 2", "scrypt_n = true"),
    "cost that is no power of 2": TEXT.replace("scrypt_n = 2", "scrypt_n = 3"),
    "negative cost": TEXT.replace("scrypt_n = 2", "scrypt_n = -2"),
    "endless cost": TEXT.replace("scrypt_n = 2", f"scrypt_n = {2**40}"),
    "number with many digits": TEXT.replace("scrypt_n = 2", "scrypt_n = " + "9" * 5000),
    "parallelism": TEXT.replace("scrypt_p = 1", f"scrypt_p = {2**30}"),
    "block size": TEXT.replace("scrypt_r = 8", "scrypt_r = 1"),
    "hash": TEXT.replace('hash = "', 'hash = "xy'),
    "salt": TEXT.replace('salt = "', 'salt = "00" #'),
    "too many": format_users({f"u{number}": user(f"u{number}") for number in range(MAX_USERS + 1)}),
    "too large": TEXT + "#" * 100_000,
    "nested": "x = " + "[" * 10_000,
}


@pytest.mark.parametrize("text", DAMAGED.values(), ids=DAMAGED)
def test_a_damaged_file_gives_one_sentence(tmp_path, text):
    path = tmp_path / "users.toml"
    path.write_text(text)
    with pytest.raises(ConfigurationError, match="pneuforce users add") as caught:
        load_users(path)
    sentence = str(caught.value)
    assert sentence.startswith(f"{path}: the file of the users is damaged: ")
    assert sentence.isprintable()
    assert len(sentence) < 500
    assert not any(user.password.digest.hex() in sentence for user in USERS.values())


def test_a_file_that_is_not_text_or_not_a_file_gives_one_sentence(tmp_path):
    path = tmp_path / "users.toml"
    path.write_bytes(b"\xff")
    with pytest.raises(ConfigurationError, match="damaged"):
        load_users(path)
    with pytest.raises(ConfigurationError, match="is a folder"):
        load_users(tmp_path)
