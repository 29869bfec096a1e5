"""When a bus that has failed is opened anew."""

from registers.can.bus import BusAt
from tests.registers.can.buses import numbered, opened
from tests.registers.can.conftest import wait_for
from tests.registers.can.test_live import dying


def test_each_failure_of_a_bus_that_was_well_is_a_new_one(monkeypatch):
    attempts_s = []
    monkeypatch.setattr("registers.can.live.WELL_S", -1.0)
    monkeypatch.setattr("registers.can.live.Bus", dying(attempts_s))
    with opened(BusAt()) as bus:
        bus.send(numbered(1))
        wait_for(lambda: len(attempts_s) == 5)
        assert bus._back_off.wait_s <= 0.2
