"""Tests of `pneuforce cansend` on a CAN hub. python-can receives the frames."""

import socket
import subprocess
import sys

import can
import pytest

from tests.registers.can.conftest import hub_process


@pytest.fixture(scope="module")
def port():
    with hub_process() as (port, _):
        yield port


def cansend(port, *frames, lines=""):
    command = [sys.executable, "-m", "pneuforce", "cansend", *frames, "--port", str(port)]
    return subprocess.run(command, input=lines, capture_output=True, text=True, timeout=60, check=False)


def test_arguments_and_lines_of_candump_are_sent_in_their_order(port):
    with can.Bus(interface="socketcand", channel="can0", host="127.0.0.1", port=port, tcp_tune=True) as bus:
        done = cansend(port, "123#0102", "-", lines="(1.0) can0 124#02\n\n(2.0) can0 18DAF110#\n")
        received = [bus.recv(5.0) for _ in range(3)]
    assert (done.returncode, done.stderr) == (0, "")
    frames = [(message.arbitration_id, bytes(message.data)) for message in received]
    assert frames == [(0x123, b"\1\2"), (0x124, b"\2"), (0x18DAF110, b"")]


def test_the_bus_is_read_while_no_line_arrives():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        process = waiting_for_a_line(listener.getsockname()[1])
        server, _ = listener.accept()
        with server:
            server.settimeout(30)
            server.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 1 << 16)
            for answer in (b"< hi >", b"< ok >", b"< ok >"):
                server.sendall(answer)
                server.recv(100)  # open, rawmode, and the argument
            server.sendall(b"< frame 185 1.000000 0000000000000000 >" * 50000)  # 2 MB
    process.communicate("")
    assert process.returncode == 0


def waiting_for_a_line(port):
    """Start cansend, which sends one frame and then waits for lines."""
    command = [sys.executable, "-m", "pneuforce", "cansend", "205#FF", "-", "--port", str(port)]
    return subprocess.Popen(command, stdin=subprocess.PIPE, text=True)


def test_nothing_is_sent_if_an_argument_is_no_frame(port):
    with can.Bus(interface="socketcand", channel="can0", host="127.0.0.1", port=port) as bus:
        done = cansend(port, "123#0102", "12#")
        assert (done.returncode, bus.recv(0.5)) == (2, None)
    assert done.stderr.startswith("pneuforce: '12#' is not a CAN frame")


def test_a_missing_bus_is_reported():
    done = cansend(1, "123#0102")
    assert done.returncode == 69
    assert "cannot be opened" in done.stderr
