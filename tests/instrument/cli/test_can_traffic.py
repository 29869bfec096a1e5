import pytest

from instrument.cli.can_traffic import Traffic, signals
from instrument.faults import HostFault
from registers.can.frames import RIG_ERROR


def forces(*counters):
    traffic = Traffic()
    return [traffic.note("Force", {"counter": counter}, now_s=0.01 * counter) for counter in counters]


@pytest.mark.parametrize(
    ("counters", "lost"),
    [
        ((7, 8, 9), [0, 0, 0]),
        ((7, 8, 11), [0, 0, 2]),
        ((254, 255, 0, 1), [0, 0, 0, 0]),
        ((254, 3), [0, 4]),
        ((7, 7), [0, 0]),  # the same frame once more is none too few
    ],
)
def test_frames_lost_show_in_the_counter(counters, lost):
    assert forces(*counters) == lost


def test_an_instrument_that_starts_again_counts_anew_and_nothing_was_lost():
    traffic = Traffic()
    traffic.note("Force", {"counter": 200}, 0.0)
    traffic.note("Heartbeat", {"node_state": "boot_up"}, 5.0)
    assert traffic.note("Force", {"counter": 1}, 5.1) == 0


def test_what_has_a_period_is_late_when_it_stays_away_and_an_answer_never_is():
    traffic = Traffic()
    for name in ("Force", "Heartbeat"):
        traffic.note(name, {"counter": 1, "node_state": "operational"}, 10.0)
    traffic.note("Answer", {"sequence": 1}, 10.0)
    force, heartbeat, answer = (traffic.kinds[name].late for name in ("Force", "Heartbeat", "Answer"))
    assert [force(11.0), force(12.0)] == [False, True]
    assert [heartbeat(12.5), heartbeat(13.5)] == [False, True]
    assert not answer(1e6)


def test_an_emergency_is_told_by_the_name_of_its_fault():
    def told(code):
        return dict(signals("Emergency", {"error_code": code}))["error_code"]

    assert told(RIG_ERROR + HostFault.LEASE_EXPIRED) == "FF20h lease expired"
    assert told(0x0000) == "0000h"
    assert told(0x8130) == "8130h"
