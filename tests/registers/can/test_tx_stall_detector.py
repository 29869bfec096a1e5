"""Tests of the detector for transmit stalls: begin and end of a stall."""

from pneuforce.registers.can.tx_stall_detector import STALL_S, TxStallDetector


def test_a_stall_begins_after_one_second_of_rejected_frames_and_is_reported_once():
    detector = TxStallDetector()
    begins_s = [step / 10 for step in range(40) if detector.frame_rejected(step / 10)]
    assert begins_s == [STALL_S]
    assert detector.stalled


def test_a_sent_frame_ends_the_stall():
    detector = TxStallDetector()
    detector.frame_rejected(0.0)
    assert not detector.frame_sent()
    assert not detector.frame_rejected(2.0)
    assert not detector.stalled
    assert detector.frame_rejected(3.0)
    assert detector.frame_sent()
    assert not detector.stalled
    assert not detector.frame_sent()
