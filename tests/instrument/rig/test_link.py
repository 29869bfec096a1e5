"""Tests of the host side of the rig link: handshake, keep-alive, sequence numbers and restarts."""

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneuforce.errors import ProtocolMismatch, TimeoutMismatch
from pneuforce.instrument.rig.firmware import CURRENT_VERSION, Firmware
from pneuforce.instrument.rig.link import MAX_STEP_S, Link, LinkPhase
from pneuforce.protocol.firmware_images import IMAGES
from pneuforce.protocol.frames import (
    FRAME_BYTES,
    MAX_ADC_SUM,
    PROTOCOL_VERSION,
    BoardKind,
    BoardState,
    Command,
    Event,
    FrameDecoder,
    Hello,
    Identify,
    Image,
    Mode,
    Sample,
    Vent,
    encode,
)

OUR_FIRMWARE = Firmware(CURRENT_VERSION, IMAGES[CURRENT_VERSION])
IMAGE = encode(Image(OUR_FIRMWARE.image_crc), 0)
HOLD = Command(mode=Mode.HOLD, setpoint_pa=8000)


def hello(uptime_ms=1000, version=PROTOCOL_VERSION):
    message = Hello(BoardKind.REAL, CURRENT_VERSION, uptime_ms, 7, 250, 2000)
    return IMAGE + encode(message, 0, version)


def sample(sequence, time_us=None, **changes):
    values = {"adc_sum": 700, "supply_mv": 5000, "valves": 0, "state": BoardState.VENTED, "faults": 0}
    values |= {"command": 0} | changes
    time_us = 2000 * sequence if time_us is None else time_us
    message = Sample(board_time_us=time_us, fault=0, setpoint_pa=0, **values)
    return encode(message, sequence)


def sent(link, command, now_s):
    return [frame.message for frame in FrameDecoder.for_host_frames().feed(link.tick(command, now_s))]


def ready(now_s=0.0):
    link = Link()
    link.feed(hello() + sample(0), now_s)
    assert link.phase is LinkPhase.READY
    return link


def times_of(link, command, until_s, step_s=0.01):
    """Return the time and the message of each frame that the link sends."""
    log = []
    for step in range(round(until_s / step_s)):
        log += [(round(step * step_s, 3), message) for message in sent(link, command, step * step_s)]
    return log


def gaps(log):
    return [round(b - a, 3) for (a, _), (b, _) in itertools.pairwise(log)]


class TestHandshake:
    """Tests of the handshake, which must be complete before any valve may move."""

    def test_identify_is_sent_every_200_ms_and_nothing_else(self):
        log = times_of(Link(), HOLD, 1.0)
        assert [message for _, message in log] == [Identify()] * 5
        assert all(0.2 <= gap <= 0.211 for gap in gaps(log))

    def test_identify_is_sent_until_samples_come(self):
        link = Link()
        link.feed(hello(), 0.0)
        assert {type(message) for _, message in times_of(link, HOLD, 0.5)} == {Identify}
        link.feed(sample(0), 0.5)
        assert sent(link, HOLD, 0.51) == [HOLD]

    def test_samples_before_the_first_hello_are_ignored(self):
        link = Link()
        assert link.feed(sample(0) + sample(1), 0.0) == []
        assert link.phase is LinkPhase.GREETING

    def test_hello_and_samples_may_come_in_one_read(self):
        samples = Link().feed(hello() + sample(5) + sample(6), 3.0)
        assert [(s.sequence, s.t_s) for s in samples] == [(5, 3.0), (6, 3.0)]

    def test_a_boot_banner_and_half_a_line_are_skipped(self):
        link = Link()
        samples = link.feed(
            b"pneuforce 1.0\r\nboot\xa5\xa5" + hello() + sample(0)[7:] + sample(1) + sample(2), 0.0
        )
        assert [s.sequence for s in samples] == [1, 2]
        assert link.lost_frames == 0

    @pytest.mark.parametrize("version", [0, 2, 255])
    def test_another_version_is_rejected_with_both_versions(self, version):
        link = Link()
        with pytest.raises(
            ProtocolMismatch, match=f"version {version}.*version {PROTOCOL_VERSION}.*no valve"
        ):
            link.feed(hello(version=version), 0.0)
        assert {type(message) for _, message in times_of(link, HOLD, 0.5)} == {Identify}

    def test_a_restart_starts_the_handshake_again(self):
        link = ready()
        link.restart()
        assert sent(link, HOLD, 0.0) == [Identify()]


class TestSequence:
    """Tests of the sequence numbers: gaps and repetitions."""

    def test_a_gap_is_counted(self):
        link = ready()
        assert [s.sequence for s in link.feed(sample(1) + sample(4) + sample(5), 0.01)] == [1, 4, 5]
        assert (link.lost_frames, link.repeated_frames) == (2, 0)

    def test_a_repeated_frame_is_not_a_new_sample(self):
        link = ready()
        assert len(link.feed(sample(1) + sample(1) + sample(1) + sample(2), 0.01)) == 2
        assert (link.lost_frames, link.repeated_frames) == (0, 2)

    def test_65535_is_followed_by_0(self):
        link = Link()
        stream = b"".join(sample(n & 0xFFFF, 2000 * n) for n in range(65_530, 65_542))
        samples = link.feed(hello() + stream, 0.0)
        assert [s.sequence for s in samples] == [*range(65_530, 65_536), *range(6)]
        assert (link.lost_frames, link.repeated_frames) == (0, 0)

    def test_a_gap_across_the_wrap_is_counted_correctly(self):
        link = Link()
        link.feed(hello() + sample(65_534) + sample(2, 2000 * 65_538), 0.0)
        assert link.lost_frames == 3

    @pytest.mark.parametrize(("step", "new"), [(0x7FFF, True), (0x8000, False), (0xFFFF, False)])
    def test_a_sequence_number_half_the_range_ahead_is_a_repetition(self, step, new):
        link = ready()
        assert bool(link.feed(sample(step), 0.01)) is new
        assert (link.lost_frames, link.repeated_frames) == (step - 1 if new else 0, int(not new))

    @pytest.mark.parametrize(("step", "elapsed_s"), [(249, 0.498), (500, 0.5)])
    def test_the_elapsed_time_of_a_sample_is_at_most_half_a_second(self, step, elapsed_s):
        (late,) = ready().feed(sample(step), 0.01)
        assert late.elapsed_s == pytest.approx(elapsed_s)

    def test_other_frames_do_not_count_in_the_sequence(self):
        link = ready()
        link.feed(
            encode(Event(0, BoardState.INFLATING, BoardState.VENTED, 0), 900) + hello(1002) + sample(1), 0.01
        )
        assert (link.lost_frames, link.repeated_frames) == (0, 0)
        assert [event.state for event in link.events] == [BoardState.INFLATING]

    def test_the_sequence_of_the_host_wraps(self):
        link = ready()
        link.command_sequence = 65_534
        sequences = [
            frame.sequence
            for t in range(4)
            for frame in FrameDecoder.for_host_frames().feed(link.tick(HOLD, t))
        ]
        assert sequences == [65_535, 0, 1, 2]


class TestRestart:
    """Tests of board restarts, which are detected by an uptime that is too small."""

    def test_a_restart_is_detected_by_the_uptime_and_starts_the_handshake_again(self):
        link = ready()
        for n in range(1, 100):
            link.feed(sample(n), n * 0.1)
        link.feed(hello(30), 10.0)
        assert (link.board_restarts, link.phase) == (1, LinkPhase.GREETING)
        assert sent(link, HOLD, 10.0) == [Identify()]
        link.feed(hello(50) + sample(0), 10.02)
        assert (link.board_restarts, link.phase) == (1, LinkPhase.READY)

    @pytest.mark.parametrize("late_s", [0.0, 0.05, 0.2])
    def test_a_late_second_hello_is_not_a_restart(self, late_s):
        link = ready()
        samples = link.feed(hello(1200) + sample(1), 0.2 + late_s)
        assert (link.board_restarts, len(samples)) == (0, 1)

    @pytest.mark.parametrize("clock_error", [-0.015, -0.005, 0.005, 0.015])
    def test_a_clock_error_is_not_a_restart_even_after_a_day(self, clock_error):
        link = ready()
        link.feed(hello(1000 + round(86_400_000 * (1 + clock_error))), 86_400.0)
        assert link.board_restarts == 0

    def test_a_restart_is_detected_even_if_the_new_uptime_is_above_the_first_one(self):
        link = ready()
        link.feed(hello(5000), 3600.0)
        assert link.board_restarts == 1

    def test_a_wrap_of_the_uptime_after_49_days_is_not_a_restart(self):
        link = Link()
        link.feed(hello(2**32 - 5_000) + sample(0), 0.0)
        link.feed(hello(5_000) + sample(1), 10.0)
        assert link.board_restarts == 0

    def test_samples_after_a_restart_are_used_without_a_false_gap(self):
        link = ready()
        link.feed(b"".join(sample(n) for n in range(1, 1000)), 2.0)
        first, second = link.feed(hello(10) + sample(0) + sample(1), 5.0)
        assert link.lost_frames == 0
        assert (first.elapsed_s, second.elapsed_s) == (MAX_STEP_S, pytest.approx(0.002))


class TestKeepAlive:
    """Tests of the keep-alive: the command is sent every 50 ms and at each change."""

    def test_the_command_is_sent_every_50_ms(self):
        log = times_of(ready(), HOLD, 1.0)
        assert {message for _, message in log} == {HOLD}
        assert all(0.05 <= gap <= 0.061 for gap in gaps(log))
        assert len(log) >= 17

    def test_a_changed_command_is_sent_immediately(self):
        link = ready()
        assert sent(link, HOLD, 0.0) == [HOLD]
        assert sent(link, HOLD, 0.001) == []
        other = Command(mode=Mode.HOLD, setpoint_pa=7000)
        assert sent(link, other, 0.002) == [other]
        assert sent(link, Command(), 0.003) == [Command()]

    @given(st.lists(st.floats(0.001, 0.03), min_size=30, max_size=60))
    def test_no_gap_exceeds_80_ms_if_the_loop_runs_every_30_ms(self, steps):
        link, now_s, last_s = ready(), 0.0, 0.0
        for step_s in steps:
            now_s += step_s
            if link.tick(HOLD, now_s):
                assert now_s - last_s <= 0.08
                last_s = now_s
        assert now_s - last_s <= 0.08

    def test_a_vent_is_sent_once_before_the_command(self):
        link = ready()
        sent(link, HOLD, 0.0)
        link.vent()
        assert sent(link, Command(), 0.001) == [Vent(), Command()]
        assert sent(link, Command(), 0.06) == [Command()]

    @pytest.mark.parametrize("wanted", [HOLD, Command()])
    def test_a_vent_is_sent_immediately_even_if_the_command_is_unchanged(self, wanted):
        link = ready()
        sent(link, wanted, 0.0)
        link.vent()
        assert sent(link, wanted, 0.001) == [Vent(), wanted]

    def test_a_vent_is_sent_even_before_the_board_has_answered(self):
        link = Link()
        link.tick(Command(), 0.0)
        link.vent()
        assert sent(link, Command(), 0.01) == [Vent()]
        assert sent(link, Command(), 0.02) == []


def test_repeated_frames_are_not_samples():
    link = ready()
    stream = [sample(n) for n in range(1, 50)]
    assert len(link.feed(b"".join(stream), 0.1)) == 49
    assert link.feed(b"".join(stream[-20:]), 0.2) == []
    assert link.repeated_frames == 20
    assert len(link.feed(sample(50), 0.3)) == 1
    assert link.lost_frames == 0


def test_another_board_is_detected_by_its_serial_number():
    link = ready()
    link.feed(encode(Hello(2, 0x100, 60_000, 99, 250, 2000), 1), 1.0)
    assert (link.board_restarts, link.phase) == (1, LinkPhase.GREETING)


class TestInvalidClock:
    """Tests with samples whose times do not match their sequence numbers. Here the clock has stopped."""

    def test_after_eight_wrong_samples_the_clock_is_invalid(self):
        link = ready()
        stream = b"".join(sample(n, 0) for n in range(1, 12))
        assert [(s.sequence, s.clock_invalid) for s in link.feed(stream, 0.1)] == [
            (8, True), (9, True), (10, True), (11, True)
        ]  # fmt: skip
        assert link.implausible_frames == 7

    def test_after_some_correct_samples_the_clock_is_valid_again(self):
        link = ready()
        link.feed(b"".join(sample(n, 0) for n in range(1, 12)), 0.1)
        samples = link.feed(b"".join(sample(n, 2000 * (n - 11)) for n in range(12, 212)), 0.5)
        assert len(samples) == 200
        assert [s.clock_invalid for s in (samples[0], samples[20], samples[99])] == [True, True, False]

    def test_samples_with_an_invalid_clock_have_the_time_of_their_reception(self):
        link = ready()
        for n in range(1, 500):
            found = link.feed(sample(n, 0), 0.002 * n)
        assert found[0].clock_invalid
        assert found[0].t_s == pytest.approx(0.998)

    def test_a_restart_of_the_handshake_resets_the_detection(self):
        link = ready()
        link.feed(b"".join(sample(n, 0) for n in range(1, 12)), 0.1)
        link.restart()
        samples = link.feed(sample(12) + sample(13), 0.2)
        assert [s.clock_invalid for s in samples] == [False, False]

    def test_one_wrong_sample_is_not_used_and_the_next_sample_is(self):
        link = ready()
        samples = link.feed(sample(1) + sample(2, 7) + sample(3), 0.1)
        assert [(s.sequence, s.elapsed_s) for s in samples] == [(1, 0.002), (3, 0.004)]
        assert (link.implausible_frames, link.lost_frames) == (1, 1)


@pytest.mark.parametrize("wrong", [{"state": 8}, {"state": 255}, {"adc_sum": MAX_ADC_SUM + 1}])
def test_an_implausible_sample_is_ignored(wrong):
    link = ready()
    assert link.feed(sample(1, **wrong), 0.1) == []
    assert link.implausible_frames == 1


def test_an_implausible_event_is_ignored():
    link = ready()
    link.feed(encode(Event(0, 9, 0, 0), 1) + encode(Event(0, 1, 200, 0), 2), 0.1)
    assert link.events == []


@given(st.binary(max_size=300))
def test_random_bytes_raise_no_exception(noise):
    link = ready()
    link.feed(noise, 1.0)
    assert link.received_bytes >= len(noise)


class TestNegotiation:
    """Tests of the host timeout, which the board must confirm before the balloon may be inflated."""

    def negotiating_link(self):
        link = Link(host_timeout_ms=5000)
        link.feed(hello() + sample(0), 0.0)
        return link

    def answer(self, link, host_timeout_ms, now_s):
        uptime_ms = 1000 + round(now_s * 1e3)
        link.feed(encode(Hello(BoardKind.REAL, 0x100, uptime_ms, 7, 250, host_timeout_ms), 0), now_s)

    def test_until_the_confirmation_only_a_vent_with_the_timeout_and_identify_are_sent(self):
        link = self.negotiating_link()
        messages = [message for _, message in times_of(link, HOLD, 0.5)]
        assert set(messages) == {Command(mode=Mode.VENT, host_timeout_ms=5000), Identify()}
        self.answer(link, 5000, 0.5)
        assert sent(link, HOLD, 0.51) == [HOLD]

    def test_a_late_answer_to_an_earlier_request_is_not_an_error(self):
        link = self.negotiating_link()
        link.tick(HOLD, 0.0)
        self.answer(link, 2000, 0.5)
        self.answer(link, 5000, 0.6)
        assert link.phase is LinkPhase.READY

    def test_a_board_with_another_timeout_is_rejected_after_a_second(self):
        link = self.negotiating_link()
        link.tick(HOLD, 0.0)
        with pytest.raises(TimeoutMismatch, match=r"2000 ms .* 5000 ms"):
            self.answer(link, 2000, 1.1)

    def test_an_image_that_was_lost_is_requested_again(self):
        link = Link()
        link.feed(hello()[FRAME_BYTES:] + sample(0), 0.0)
        assert (link.phase, link.firmware) == (LinkPhase.NEGOTIATING, None)
        assert Identify() in sent(link, HOLD, 0.0)
        link.feed(hello(), 0.1)
        assert (link.phase, link.firmware) == (LinkPhase.READY, OUR_FIRMWARE)

    def test_a_board_that_reports_no_image_is_ready_after_a_second(self):
        link = Link()
        link.feed(hello()[FRAME_BYTES:] + sample(0), 0.0)
        link.tick(HOLD, 0.0)
        link.feed(hello(uptime_ms=1900)[FRAME_BYTES:], 0.9)
        assert link.phase is LinkPhase.NEGOTIATING
        link.feed(hello(uptime_ms=2100)[FRAME_BYTES:], 1.1)
        assert (link.phase, link.firmware) == (LinkPhase.READY, Firmware(CURRENT_VERSION, None))

    def test_the_image_of_a_board_that_was_replaced_is_discarded(self):
        link = ready()
        link.feed(hello(uptime_ms=5), 10.0)
        assert (link.phase, link.image) == (LinkPhase.GREETING, None)


def test_a_sample_that_is_read_late_has_its_true_age():
    link = ready()
    link.feed(b"".join(sample(n) for n in range(1, 100)), 0.2)
    ages = [0.7 - late.t_s for late in link.feed(b"".join(sample(n) for n in range(100, 351)), 0.7)]
    assert ages[0] == pytest.approx(0.5, abs=0.001)
    assert ages[-1] == pytest.approx(0.0, abs=0.001)
