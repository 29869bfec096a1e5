"""Tests of the addresses of instruments: accepted addresses, and messages for wrong addresses."""

import socket

import pytest

import pneuforce
from pneuforce.client.address import SCHEMES, parse_url


@pytest.mark.parametrize("scheme", SCHEMES.values(), ids=SCHEMES)
def test_the_example_of_each_scheme_is_accepted(scheme):
    assert parse_url(scheme.example).text == scheme.example


@pytest.mark.parametrize(
    "url",
    [
        "",
        "127.0.0.1:5020",
        "http://127.0.0.1:5020",
        "modbus://host",
        "tcp:/host",
        "tcp://",
        "tcp://:5020",
        "tcp://host:0",
        "tcp://host:70000",
        "tcp://host:port",
        "tcp://host/1",
        "tcp://host?unit=256",
        "tcp://host?unit=-1",
        "tcp://host?unit=one",
        "tcp://host?unti=1",
        "tcp://host?unit=1&unit=2",
        "tcp://host?unit",
        "tcp://user@host",
        "rtu://dev/ttyUSB0",
        "rtu:///dev/ttyUSB0?parity=yes",
        "rtu:///dev/ttyUSB0?baud=0",
        "rtu:///",
        "can://can0",
        "can://socketcan",
        "can://pcan/can0",
        "can://socketcan/can0?node=0",
        "can://socketcan/can0?node=128",
        "can://socketcan/can0?host=127.0.0.1",
        "can://socketcan/can0?silence=nan",
        "can://socketcan/can0?silence=9",
        "rdt://",
        "rdt://host?unit=1",
        None,
        5020,
    ],
)
def test_a_wrong_address_is_a_configuration_error_with_an_example(url):
    with pytest.raises(pneuforce.ConfigurationError, match="://"):
        pneuforce.connect(url)


def test_a_port_without_a_server_and_a_missing_device_are_connection_errors(tmp_path):
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    for url in (
        f"tcp://127.0.0.1:{port}",
        f"rtu://{tmp_path}/none",
        f"rtu://{tmp_path}",
        f"can://socketcand/can0?port={port}",
        "can://socketcan/no-such-bus",
    ):
        with pytest.raises(pneuforce.ConnectionFailed):
            pneuforce.connect(url)


def test_a_server_of_another_kind_is_a_connection_error():
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        with pytest.raises(pneuforce.ConnectionFailed):
            pneuforce.connect(f"tcp://127.0.0.1:{port}")
