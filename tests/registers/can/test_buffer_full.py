"""Test of the errors for a full transmit buffer and for a failed bus."""

import errno

import can
import pytest

from pneuforce.registers.can.bus import CanAddress, CanBus, TxBufferFullError
from tests.registers.can.bus_helpers import numbered_frame


def fail_to_send(bus, error):
    def send(message, timeout):
        raise error

    bus._bus.send = send


FULL = [
    can.CanOperationError("Failed to transmit", errno.ENOBUFS),
    can.CanOperationError("Transmit buffer full"),
]
FAILED = can.CanOperationError("Failed to transmit: Network is down", errno.ENETDOWN)


@pytest.mark.parametrize(
    ("error", "error_class"),
    [(FULL[0], TxBufferFullError), (FULL[1], TxBufferFullError), (FAILED, OSError)],
    ids=str,
)
def test_a_full_buffer_and_a_failed_bus_raise_different_errors(error, error_class):
    """The errors are those of python-can's socketcan interface. They normally occur on real hardware only."""
    bus = CanBus(CanAddress(interface="virtual", channel="full"))
    try:
        fail_to_send(bus, error)
        with pytest.raises(OSError, match="ransmit") as caught:
            bus.send(numbered_frame(1))
        assert caught.type is error_class
    finally:
        bus.close()
