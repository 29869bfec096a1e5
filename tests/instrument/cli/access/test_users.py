"""Tests of the commands `pneuforce users …`."""

import json
import os
import pty
import stat
import sys

import pytest
from typer.testing import CliRunner

from pneuforce.errors import ConfigurationError, UsageError
from pneuforce.instrument.cli.app import app
from pneuforce.instrument.cli.terminal.exit_codes import exit_code_of
from pneuforce.instrument.config import load
from pneuforce.instrument.users.file import ROLES, load_users
from tests.web.users import OPERATOR, PASSWORD, USERS, users_file

SECRET = "correct horse battery"


def users(*words, password=""):
    """Run `pneuforce users` with these words. Return its output; raise its error."""
    done = CliRunner().invoke(app, ["users", *map(str, words)], input=password)
    assert SECRET not in done.output + str(done.exception)
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        raise done.exception
    assert done.exit_code == 0, done.output
    return done.output


def test_users_are_added_listed_changed_and_removed(tmp_path):
    config = tmp_path / "instrument.toml"
    config.write_text('[web]\nenabled = true\nusers_file = "people.toml"\n')
    path = tmp_path / "people.toml"
    assert "anna can log in as operator" in users(
        "add", "anna", "--role", "operator", "--config", config, password=f"{SECRET}\n"
    )
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert SECRET not in path.read_text()
    added = json.loads(
        users("add", "bob", "--role", "viewer", "--file", path, "--json", password=f"{SECRET}\r\nmore")
    )
    assert (added["ok"], added["name"], added["role"]) == (True, "bob", "viewer")
    listed = json.loads(users("list", "--config", config, "--json"))
    assert (listed["ok"], listed["code"], listed["message"]) == (True, "done", "2 users")
    assert (listed["file"], listed["users"]) == (str(path), {"anna": "operator", "bob": "viewer"})
    assert users("list", "--file", path).split() == ["anna", "operator", "bob", "viewer"]
    before = load_users(path)
    users("password", "anna", "--file", path, password="another password")
    assert load_users(path)["anna"].password.matches("another password")
    users("remove", "anna", "--file", path)
    assert load_users(path) == {"bob": before["bob"]}


@pytest.mark.parametrize(
    ("words", "password", "part"),
    [
        (("add", "anna", "--role", "viewer"), SECRET, "users password"),
        (("add", "Eve", "--role", "viewer"), SECRET, "small letters"),
        (("add", "eve\n", "--role", "viewer"), SECRET, "small letters"),
        (("add", "eve", "--role", "viewer"), "short", "12 to 128"),
        (("add", "eve", "--role", "viewer"), "", "12 to 128"),
        (("add", "eve", "--role", "viewer"), "x" * 1000, "12 to 128"),
        (("password", "eve"), SECRET, "anna, bob"),
        (("remove", "eve"), "", "anna, bob"),
    ],
)
def test_an_impossible_change_is_rejected_with_a_sentence_and_changes_nothing(
    tmp_path, words, password, part
):
    file = users_file(tmp_path)
    with pytest.raises(UsageError, match=part) as caught:
        users(*words, "--file", file, password=password)
    assert exit_code_of(caught.value) == 2
    assert load_users(tmp_path / "users.toml") == USERS


def test_the_file_must_be_named_and_exist(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ConfigurationError, match="--config"):
        users("add", "anna", "--role", "operator", password=SECRET)
    with pytest.raises(ConfigurationError, match="users add"):
        users("list", "--file", "none.toml")
    with pytest.raises(ConfigurationError, match="only one"):
        users("list", "--file", "a", "--config", "b")
    users_file(tmp_path)
    assert OPERATOR in users("list")


def test_a_missing_folder_is_named_before_a_password_is_asked_for(tmp_path, monkeypatch):
    monkeypatch.setattr("pneuforce.instrument.cli.access.users._new_hash", pytest.fail)
    with pytest.raises(
        ConfigurationError, match=f"create the folder {tmp_path}/absent, or name another file"
    ):
        users("add", "anna", "--role", "operator", "--file", tmp_path / "absent/users.toml")


def test_a_password_is_typed_twice_on_a_terminal_and_not_shown(tmp_path):
    command = ["-m", "pneuforce", "users", "password", OPERATOR, "--file", users_file(tmp_path)]
    for second, code in (("another password", 0), ("something else 1", 2)):
        pid, terminal = pty.fork()
        if pid == 0:
            os.execv(sys.executable, [sys.executable, *command])
        shown = read_until(terminal, b": ")
        os.write(terminal, b"another password\n")
        shown += read_until(terminal, b": ")
        os.write(terminal, second.encode() + b"\n")
        shown += read_until(terminal, b"users.toml is changed" if code == 0 else b"nothing was changed")
        assert os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) == code
        os.close(terminal)
        assert b"another" not in shown
    assert load_users(tmp_path / "users.toml")[OPERATOR].password.matches("another password")


def read_until(terminal, end):
    shown = b""
    while end not in shown:
        shown += os.read(terminal, 1024)
    return shown


def test_the_roles_of_the_command_are_the_default_roles():
    from typing import get_args

    from pneuforce.instrument.cli.access.user_commands import Role

    assert get_args(Role) == ROLES


def test_the_token_of_earlier_versions_is_rejected_with_the_command_that_replaces_it(tmp_path):
    path = tmp_path / "instrument.toml"
    path.write_text(f'[web]\ntoken = "{PASSWORD}"\n')
    with pytest.raises(ConfigurationError, match=r"web\.token: .*pneuforce users add NAME --role") as caught:
        load(path)
    assert PASSWORD not in str(caught.value)
