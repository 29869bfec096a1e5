"""Tests of the reasons why a program cannot listen, and of the check of privileged ports."""

import asyncio
import errno
import os
import socket
from types import SimpleNamespace

import pytest

from pneuforce.errors import ConfigurationFileError, ServerError
from pneuforce.instrument.config import parse
from pneuforce.instrument.service.buses.modbus_server import open_modbus
from pneuforce.instrument.service.buses.rdt_server import open_rdt
from pneuforce.instrument.service.checks.port_checks import port_remarks
from pneuforce.instrument.service.checks.service_user import service_permissions
from pneuforce.support.listening import (
    first_unprivileged_port,
    has_address,
    listen_failure,
    may_listen,
)

EXIT_CLASSES = [
    (errno.EACCES, ConfigurationFileError, "CAP_NET_BIND_SERVICE"),
    (errno.EADDRINUSE, ServerError, "port"),
    (errno.EADDRNOTAVAIL, ServerError, "host"),
]


@pytest.mark.parametrize(("number", "kind", "word"), EXIT_CLASSES)
def test_only_a_missing_privilege_is_an_error_of_the_configuration(number, kind, word):
    def fail():
        raise OSError(number, os.strerror(number))

    async def start():
        fail()

    configuration = parse({"modbus": {"port": 502}}, "x")
    rdt = SimpleNamespace(open=fail, options=SimpleNamespace(host="127.0.0.1", port=500))
    for opening, port in (
        (open_modbus(SimpleNamespace(start=start), configuration), 502),
        (open_rdt(rdt), 500),
    ):
        with pytest.raises(kind) as caught:
            asyncio.run(opening)
        assert type(caught.value) is kind
        assert f":{port}" in str(caught.value)
        assert word in str(caught.value)
    assert "[web]" in listen_failure(OSError(number, os.strerror(number)), "web", 443)


def can_bind(port):
    with socket.socket() as server:
        try:
            server.bind(("127.0.0.1", port))
        except PermissionError:
            return False
        except OSError:  # another program uses the port
            return True
    return True


@pytest.mark.parametrize("user", ["nobody", "no-such-user"])
def test_the_check_of_a_port_agrees_with_the_operating_system(user):
    with service_permissions(user):
        for port in (0, 1, 502, first_unprivileged_port(), 65535):
            assert may_listen(port) == can_bind(port), port


def test_a_port_without_privilege_is_a_remark_about_its_key():
    tables = {"modbus": {"port": 502}, "rdt": {"enabled": True, "port": 600}, "web": {"port": 80}}
    with service_permissions("nobody"):
        permitted = can_bind(502)
    keys = [remark.partition(" ")[0] for remark in port_remarks(parse(tables, "x"), "nobody")]
    assert keys == ([] if permitted else ["modbus.port", "rdt.port"])
    assert port_remarks(parse({}, "x"), "nobody") == []


@pytest.mark.parametrize(
    ("host", "present"),
    [
        *((host, True) for host in ("127.0.0.1", "0.0.0.0", "::", "localhost", "no.such.example")),
        *((host, False) for host in ("203.0.113.9", "2001:db8::9")),  # reserved for documents
    ],
)
def test_an_address_that_no_interface_has_is_a_remark(host, present):
    assert has_address(host) == present
    table = {"enabled": True, "host": host, "allow": ["10.0.0.1"]}
    remarks = port_remarks(parse({"modbus": table, "rdt": table}, "x"), "no-such-user")
    keys = [] if present else ["modbus.host", "rdt.host"]
    assert [remark.partition(" = ")[0] for remark in remarks] == keys
