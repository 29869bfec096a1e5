"""Test of the waits between attempts to open a failed bus again."""

from pneuforce.registers.can.bus import CanAddress
from tests.registers.can.bus_helpers import numbered_frame, opened_connection
from tests.registers.can.conftest import wait_for
from tests.registers.can.test_connection import failing_interface


def test_after_a_stable_connection_the_waits_start_again_with_the_shortest(monkeypatch):
    attempts_s = []
    monkeypatch.setattr("pneuforce.registers.can.connection.STABLE_S", -1.0)
    monkeypatch.setattr("pneuforce.registers.can.connection.CanBus", failing_interface(attempts_s))
    with opened_connection(CanAddress()) as bus:
        bus.send(numbered_frame(1))
        wait_for(lambda: len(attempts_s) == 5)
        assert bus._backoff.wait_s <= 0.2
