"""Tests of the carrier state of a CAN interface. The files have the content that a Linux kernel writes."""

import errno
from pathlib import Path

import pytest

from pneuforce.registers.can.bus import CanAddress, CanBus
from pneuforce.registers.can.carrier import link_problem


@pytest.fixture
def carrier(tmp_path, monkeypatch):
    """Return a function that writes the carrier file of can0."""
    monkeypatch.setattr("pneuforce.registers.can.carrier.CARRIER_FILE", f"{tmp_path}/{{}}")
    return (tmp_path / "can0").write_text


def test_an_interface_with_a_carrier_has_no_problem(carrier):
    carrier("1\n")
    assert link_problem("can0") == ""


def test_a_controller_that_is_bus_off_has_no_carrier_and_is_not_opened(carrier):
    carrier("0\n")
    with pytest.raises(OSError, match=r"socketcan can0 .* bus-off"):
        CanBus(CanAddress(interface="socketcan", channel="can0"))


def test_an_interface_that_is_down_has_a_carrier_that_cannot_be_read(monkeypatch):
    def fail(path, encoding):
        raise OSError(errno.EINVAL, "Invalid argument")

    monkeypatch.setattr(Path, "read_text", fail)
    assert link_problem("can0") == "the interface is down"


def test_without_a_carrier_file_no_problem_is_reported():
    assert link_problem("no such interface") == ""


def test_the_loopback_interface_of_this_machine_has_no_problem():
    assert link_problem("lo") == ""
