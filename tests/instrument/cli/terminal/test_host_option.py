"""Tests of the option --host: only an address is accepted, and a password in it is not repeated."""

import pytest
import typer

from pneuforce.instrument.cli.terminal.options import checked_host
from tests.command_runner import pneuforce


@pytest.mark.parametrize("host", [None, "127.0.0.1", "::1", "fe80::1%eth0", "sensor.local", "localhost"])
def test_an_address_or_a_name_is_accepted(host):
    assert checked_host(host) == host


@pytest.mark.parametrize("host", ["", "a b", "anna:secret@127.0.0.1", "tcp://anna:secret@rig", "rig:5020"])
def test_other_texts_are_rejected_without_their_password(host):
    with pytest.raises(typer.BadParameter) as caught:
        checked_host(host)
    assert "secret" not in caught.value.message


@pytest.mark.parametrize(
    "words",
    [
        ("status", "--host"),
        ("watch", "can", "--interface", "socketcand", "--host"),
        ("canlog", "--interface", "socketcand", "--host"),
        ("overview", "left.toml", "--host"),
    ],
)
def test_the_commands_check_the_option(words):
    done = pneuforce(*words, "anna:secret@127.0.0.1")
    assert done.returncode == 2
    assert "neither an IP address nor a host name" in done.stderr
    assert "secret" not in done.stderr
