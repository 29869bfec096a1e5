"""What the kernel tells of an interface; the files are as a Linux kernel writes them."""

import errno
from pathlib import Path

import pytest

from registers.can.bus import Bus, BusAt
from registers.can.carrier import trouble_of


@pytest.fixture
def carrier(tmp_path, monkeypatch):
    """Writes what the kernel says of can0."""
    monkeypatch.setattr("registers.can.carrier.CARRIER", f"{tmp_path}/{{}}")
    return (tmp_path / "can0").write_text


def test_an_interface_with_a_carrier_is_well(carrier):
    carrier("1\n")
    assert trouble_of("can0") == ""


def test_a_controller_that_is_bus_off_has_no_carrier_and_is_not_opened(carrier):
    carrier("0\n")
    with pytest.raises(OSError, match=r"CAN on socketcan can0 cannot be opened: .* is bus-off or stopped$"):
        Bus(BusAt(interface="socketcan", channel="can0"))


def test_an_interface_that_is_down_has_a_carrier_that_cannot_be_read(monkeypatch):
    def refuse(path, encoding):
        raise OSError(errno.EINVAL, "Invalid argument")

    monkeypatch.setattr(Path, "read_text", refuse)
    assert trouble_of("can0") == "the interface is down"


def test_where_the_system_does_not_say_the_opening_tells():
    assert trouble_of("can0 of nobody") == ""


def test_the_loopback_of_this_machine_is_well():
    assert trouble_of("lo") == ""
