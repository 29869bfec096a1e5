from registers.can.back_off import BackOff
from registers.can.bus import BusAt
from tests.registers.can.buses import numbered, opened
from tests.registers.can.conftest import wait_for
from tests.registers.can.test_live import dying


def test_the_waits_double_from_a_tenth_of_a_second_to_two_seconds():
    back_off, waits_s = BackOff(), []
    for _ in range(8):
        waits_s.append(back_off.wait_s)
        back_off.tried()
    assert waits_s == [0.1, 0.2, 0.4, 0.8, 1.6, 2.0, 2.0, 2.0]


def waited_longer():
    back_off = BackOff()
    for _ in range(3):
        back_off.tried()
    back_off.opened(100.0)
    return back_off


def test_a_bus_that_stayed_well_is_opened_anew_at_once():
    back_off = waited_longer()
    back_off.failed(106.0)
    assert back_off.wait_s == 0.1


def test_a_bus_that_fails_soon_is_waited_for_as_long_as_before():
    back_off = waited_longer()
    back_off.failed(104.0)
    assert back_off.wait_s == 0.8


def test_each_failure_of_a_bus_that_was_well_is_a_new_one(monkeypatch):
    attempts_s = []
    monkeypatch.setattr("registers.can.back_off.WELL_S", -1.0)
    monkeypatch.setattr("registers.can.live.Bus", dying(attempts_s))
    with opened(BusAt()) as bus:
        bus.send(numbered(1))
        wait_for(lambda: len(attempts_s) == 5)
        assert bus._back_off.wait_s <= 0.2
