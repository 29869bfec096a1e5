import errno

import can
import pytest

from registers.can.bus import Bus, BusAt, BusFull
from tests.registers.can.buses import numbered


def failing(bus, error):
    def send(message, timeout):
        raise error

    bus._bus.send = send


FULL = [
    can.CanOperationError("Failed to transmit", errno.ENOBUFS),
    can.CanOperationError("Transmit buffer full"),
]
GONE = can.CanOperationError("Failed to transmit: Network is down", errno.ENETDOWN)


@pytest.mark.parametrize(
    ("error", "kind"), [(FULL[0], BusFull), (FULL[1], BusFull), (GONE, OSError)], ids=str
)
def test_a_full_buffer_is_told_from_a_bus_that_is_gone(error, kind):
    """As python-can's socketcan raises them; only a controller in hardware would, by itself."""
    bus = Bus(BusAt(interface="virtual", channel="full"))
    try:
        failing(bus, error)
        with pytest.raises(OSError, match="ransmit") as caught:
            bus.send(numbered(1))
        assert caught.type is kind
    finally:
        bus.close()
