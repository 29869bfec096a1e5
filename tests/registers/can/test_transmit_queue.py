"""Tests of the transmit queue: number and age of frames are limited."""

import threading

from pneuforce.registers.can.transmit_queue import MAX_FRAMES, DropCause, TransmitQueue
from pneuforce.registers.can.wire import CanFrame


def remaining(queue):
    queue.close()
    return list(iter(queue.get, None))


def test_a_full_queue_drops_its_oldest_frame():
    queue = TransmitQueue(lambda: 0.0)
    for number in range(MAX_FRAMES + 3):
        queue.put(CanFrame(number))
    assert [frame.id for frame in remaining(queue)] == list(range(3, MAX_FRAMES + 3))
    assert queue.dropped == queue.drops[DropCause.OUTDATED] == 3


def test_a_frame_that_waited_too_long_is_dropped():
    now_s = 0.0
    queue = TransmitQueue(lambda: now_s)
    queue.put(CanFrame(1))
    now_s = 0.11
    queue.put(CanFrame(2))
    assert [frame.id for frame in remaining(queue)] == [2]
    assert queue.dropped == queue.drops[DropCause.OUTDATED] == 1


def test_a_frame_with_old_values_is_dropped_even_if_it_was_queued_just_now():
    queue = TransmitQueue(
        lambda: 0.3
    )  # this process did not run from 0.0 s, the time of the values, to 0.3 s
    queue.put(CanFrame(1), 0.0)
    queue.put(CanFrame(2), 0.25)
    assert [frame.id for frame in remaining(queue)] == [2]
    assert queue.dropped == queue.drops[DropCause.OUTDATED] == 1


def test_a_waiting_thread_receives_a_frame_and_ends_when_the_queue_is_closed():
    queue, taken = TransmitQueue(), []
    reader = threading.Thread(target=lambda: taken.extend(iter(queue.get, None)))
    reader.start()
    queue.put(CanFrame(1))
    queue.close()
    reader.join(600.0)
    assert taken == [CanFrame(1)]
    assert not reader.is_alive()
