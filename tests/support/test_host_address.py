"""Tests of the message for a host name without an address."""

import pytest

from pneuforce.registers.modbus.client import ModbusClient, NoAnswerError
from pneuforce.support.host_address import address_problem


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "::1"])
def test_a_host_with_an_address_has_no_problem(host):
    assert address_problem(host) == ""


@pytest.mark.parametrize("host", ["unknown.invalid", "a" * 70 + ".invalid", "a..b"])
def test_a_name_without_an_address_is_named(host):
    assert address_problem(host).startswith(f"the host name {host} has no address: ")


def test_a_modbus_client_names_an_unknown_host_instead_of_a_missing_server():
    with pytest.raises(NoAnswerError, match=r"the host name unknown\.invalid has no address"):
        ModbusClient.connect("unknown.invalid", wait_s=0.2)
