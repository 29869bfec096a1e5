"""Tests of received CAN traffic: lost frames, late frames and names of faults."""

import pytest

from pneuforce.instrument.cli.watch.can_traffic import CanTraffic, format_signals
from pneuforce.instrument.core.faults import HostFault
from pneuforce.registers.can.frames import RIG_ERROR


def lost_frames(*counters):
    """Receive Force frames with these counters. Return the number of lost frames at each frame."""
    traffic = CanTraffic()
    return [traffic.add("Force", {"counter": counter}, now_s=0.01 * counter) for counter in counters]


@pytest.mark.parametrize(
    ("counters", "lost"),
    [
        ((7, 8, 9), [0, 0, 0]),
        ((7, 8, 11), [0, 0, 2]),
        ((254, 255, 0, 1), [0, 0, 0, 0]),
        ((254, 3), [0, 4]),
        ((7, 7), [0, 0]),  # a repeated frame is not a loss
    ],
)
def test_lost_frames_are_counted_by_the_counter(counters, lost):
    assert lost_frames(*counters) == lost


def test_a_restart_of_the_instrument_is_not_a_loss():
    traffic = CanTraffic()
    traffic.add("Force", {"counter": 200}, 0.0)
    traffic.add("Heartbeat", {"node_state": "boot_up"}, 5.0)
    assert traffic.add("Force", {"counter": 1}, 5.1) == 0


def test_only_a_frame_with_a_period_can_be_late():
    traffic = CanTraffic()
    for name in ("Force", "Heartbeat"):
        traffic.add(name, {"counter": 1, "node_state": "operational"}, 10.0)
    traffic.add("Answer", {"sequence": 1}, 10.0)
    force, heartbeat, answer = (traffic.kinds[name].is_late for name in ("Force", "Heartbeat", "Answer"))
    assert [force(11.0), force(12.0)] == [False, True]
    assert [heartbeat(12.5), heartbeat(13.5)] == [False, True]
    assert not answer(1e6)


def test_an_emergency_shows_the_name_of_its_fault():
    def error_text(code):
        return dict(format_signals("Emergency", {"error_code": code}))["error_code"]

    assert error_text(RIG_ERROR + HostFault.LEASE_EXPIRED) == "FF20h lease expired"
    assert error_text(0x0000) == "0000h"
    assert error_text(0x8130) == "8130h"
