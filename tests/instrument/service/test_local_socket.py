"""The local socket's name: taken only from who is gone, given up only where it is still ours."""

import asyncio
import socket

import pytest

from instrument.cli.local_socket import LocalSocket
from instrument.errors import FaceError


def opened(path):
    own = LocalSocket(path, asyncio.Protocol)
    asyncio.run(own.open())
    return own


def test_a_name_that_a_dead_instrument_left_is_taken(tmp_path):
    path = tmp_path / "s"
    with socket.socket(socket.AF_UNIX) as dead:
        dead.bind(str(path))
    assert opened(path).in_place


@pytest.mark.parametrize("kind", [socket.SOCK_DGRAM, socket.SOCK_SEQPACKET, socket.SOCK_STREAM])
def test_a_name_that_is_another_programs_is_left_alone(tmp_path, kind):
    path = tmp_path / "s"
    with socket.socket(socket.AF_UNIX, kind) as other:
        other.bind(str(path))
        if kind != socket.SOCK_DGRAM:
            other.listen()
        with pytest.raises(FaceError, match="another"):
            opened(path)
        assert path.exists()


@pytest.mark.parametrize(
    "make", [lambda p: p.write_text(""), lambda p: p.mkdir(), lambda p: p.symlink_to("x")]
)
def test_what_is_no_socket_is_left_alone(tmp_path, make):
    path = tmp_path / "s"
    make(path)
    with pytest.raises(FaceError, match="no socket"):
        opened(path)
    assert path.exists() or path.is_symlink()


def test_at_the_end_another_ones_name_stays(tmp_path):
    own = opened(tmp_path / "s")
    own.path.unlink()
    assert not own.in_place
    with socket.socket(socket.AF_UNIX) as other:
        other.bind(str(own.path))
        assert not own.in_place
        own.close()
        assert own.path.exists()


def test_a_path_that_is_too_long_is_told(tmp_path):
    with pytest.raises(FaceError, match="too long"):
        opened(tmp_path / ("x" * 120))
