"""Tests of the local socket's name: `open` replaces only a stale name, `close` removes only its own."""

import asyncio
import socket

import pytest

from pneuforce.errors import ServerError
from pneuforce.instrument.service.local_socket.unix_socket import LocalSocket


def opened(path):
    local = LocalSocket(path, asyncio.Protocol)
    asyncio.run(local.open())
    return local


def test_a_stale_name_is_taken(tmp_path):
    path = tmp_path / "s"
    with socket.socket(socket.AF_UNIX) as dead:
        dead.bind(str(path))
    assert opened(path).in_place


@pytest.mark.parametrize("kind", [socket.SOCK_DGRAM, socket.SOCK_SEQPACKET, socket.SOCK_STREAM])
def test_the_name_of_another_program_is_not_taken(tmp_path, kind):
    path = tmp_path / "s"
    with socket.socket(socket.AF_UNIX, kind) as other:
        other.bind(str(path))
        if kind != socket.SOCK_DGRAM:
            other.listen()
        with pytest.raises(ServerError, match="another"):
            opened(path)
        assert path.exists()


@pytest.mark.parametrize(
    "make", [lambda p: p.write_text(""), lambda p: p.mkdir(), lambda p: p.symlink_to("x")]
)
def test_a_file_is_not_replaced(tmp_path, make):
    path = tmp_path / "s"
    make(path)
    with pytest.raises(ServerError, match="not a socket"):
        opened(path)
    assert path.exists() or path.is_symlink()


def test_close_does_not_remove_the_name_of_another_socket(tmp_path):
    local = opened(tmp_path / "s")
    local.path.unlink()
    assert not local.in_place
    with socket.socket(socket.AF_UNIX) as other:
        other.bind(str(local.path))
        assert not local.in_place
        local.close()
        assert local.path.exists()


def test_a_path_that_is_too_long_is_reported(tmp_path):
    with pytest.raises(ServerError, match="too long"):
        opened(tmp_path / ("x" * 120))
