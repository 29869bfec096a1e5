import threading

from registers.can.outbox import MOST_FRAMES, Outbox
from registers.can.wire import CanFrame


def drained(outbox):
    outbox.close()
    return list(iter(outbox.take, None))


def test_a_full_outbox_drops_its_oldest_frame():
    outbox = Outbox(lambda: 0.0)
    for number in range(MOST_FRAMES + 3):
        outbox.put(CanFrame(number))
    assert [frame.id for frame in drained(outbox)] == list(range(3, MOST_FRAMES + 3))
    assert outbox.dropped == 3


def test_a_frame_that_waited_too_long_is_dropped():
    now_s = 0.0
    outbox = Outbox(lambda: now_s)
    outbox.put(CanFrame(1))
    now_s = 0.11
    outbox.put(CanFrame(2))
    assert [frame.id for frame in drained(outbox)] == [2]
    assert outbox.dropped == 1


def test_whoever_waits_for_a_frame_gets_it_and_ends_with_the_outbox():
    outbox, taken = Outbox(), []
    taker = threading.Thread(target=lambda: taken.extend(iter(outbox.take, None)))
    taker.start()
    outbox.put(CanFrame(1))
    outbox.close()
    taker.join(10.0)
    assert taken == [CanFrame(1)]
    assert not taker.is_alive()
