"""Tests of the host on a real pseudo-terminal, with a simple board in a thread at the other end."""

import asyncio
import contextlib
import itertools
import logging
import time

import pytest

from pneuforce.errors import PortBusy, PortUnavailable, ProtocolMismatch, RigNotResponding, TimeoutMismatch
from pneuforce.instrument.core.controller import Instrument
from pneuforce.instrument.core.faults import HostFault
from pneuforce.instrument.core.session import Session
from pneuforce.instrument.core.settings import Settings
from pneuforce.instrument.service.host.host import FIRST_RETRY_S, Host
from pneuforce.protocol.frames import (
    BoardKind,
    BoardState,
    Command,
    Event,
    Fault,
    Hello,
    Identify,
    Mode,
    Sample,
    Vent,
    encode,
)
from pneuforce.protocol.limits import HOST_SILENCE_S, VENTED_S
from pneuforce.support.serial_port import SerialPort
from tests.instrument.fake_board import FakeBoard
from tests.instrument.instrument_harness import HOLD_8, PLC, VENT

TIMEOUT_S = 20.0


@contextlib.asynccontextmanager
async def running(cable):
    """Run a connected host. On exit, the host vents the balloon and ends."""
    host, stop = Host(Session(Instrument(Settings())), str(cable.path)), asyncio.Event()
    await host.connect(asyncio.Event())
    task = asyncio.create_task(host.run(stop))
    try:
        yield host
    finally:
        stop.set()
        await asyncio.wait_for(task, TIMEOUT_S)


async def until(condition, timeout_s=TIMEOUT_S):
    deadline_s = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < deadline_s, "the condition was not true in time"
        await asyncio.sleep(0.005)


class SentByTick:
    """Output channel that stores the sequence number of the last command at each tick."""

    def __init__(self, host):
        self.sequences, self._link = [], host.link
        host.channels.append(self)

    def on_sample(self, now_s):
        pass

    def tick(self, now_s):
        self.sequences.append(self._link.command_sequence)


def snapshot_of(host):
    return host.instrument.snapshot(PLC, time.monotonic())


def gaps_above(host, bound_s):
    """Return the number of gaps between commands that were longer than a bound of the histogram."""
    gaps = host.command_gaps.values()
    return sum(gaps["counts"][gaps["bounds_s"].index(bound_s) + 1 :])


async def inflate(host):
    await until(lambda: host.instrument.chain.zero.taken)
    for request in (VENT, HOLD_8):
        assert host.instrument.write(PLC, request, time.monotonic()) == "none"
    await until(lambda: snapshot_of(host).state == "holding")


def test_the_host_identifies_the_board_measures_and_inflates(cable):
    async def run():
        board = cable.plug()
        async with running(cable) as host:
            await inflate(host)
            assert snapshot_of(host).setpoint_kpa == 8.0
            assert {"simulated", "holding"} <= snapshot_of(host).status
            assert host.link.lost_frames == 0
        kinds = [type(message) for _, message in board.received]
        assert kinds[0] is Identify
        assert Identify not in kinds[kinds.index(Command) :]

    asyncio.run(run())


def test_commands_are_sent_regularly_and_at_every_change(cable):
    async def run():
        board = cable.plug()
        async with running(cable) as host:
            await inflate(host)
            sent = SentByTick(host)
            await until(lambda: len(sent.sequences) > 50)
            # Commands are sent every 50 ms and ticks are 10 ms apart: about five ticks have the same command.
            assert max(len(list(same)) for _, same in itertools.groupby(sent.sequences)) <= 7
            for setpoint_pa in (6000, 7000, 6500, 7500, 6000):
                ticks, sequence = len(sent.sequences), host.link.command_sequence
                change = {"setpoint_requested_kpa": setpoint_pa / 1e3}
                assert host.instrument.write(PLC, change, time.monotonic()) == "none"
                await until(lambda ticks=ticks: len(sent.sequences) > ticks)
                assert sent.sequences[ticks] == sequence + 1
            await until(lambda: board.messages(Command)[-1][1].setpoint_pa == 6000)

    asyncio.run(run())


def test_samples_received_while_the_process_was_stopped_keep_their_age(cable):
    async def run():
        board = cable.plug()
        async with running(cable) as host:
            await until(lambda: snapshot_of(host).sample_counter > 100)
            ages, process = [], host.instrument.process
            host.instrument.process = lambda raw: ages.append(time.monotonic() - raw.t_s) or process(raw)
            first, deadline_s = board._samples, time.monotonic() + TIMEOUT_S
            while board._samples < first + 75 and time.monotonic() < deadline_s:
                time.sleep(0.01)  # the complete loop is blocked
            await until(lambda: len(ages) > 75)
            await until(lambda: snapshot_of(host).age_s < 0.05)
            assert max(ages) > 0.1
            assert host.link.lost_frames == 0

    asyncio.run(run())


def test_a_blocked_loop_does_not_trip_because_the_samples_waited_in_a_buffer(cable):
    async def run():
        cable.plug()
        async with running(cable) as host:
            await inflate(host)
            long_gaps, total_s = gaps_above(host, HOST_SILENCE_S), host.command_gaps.values()["sum_s"]
            time.sleep(0.3)  # the complete loop is blocked
            counter = snapshot_of(host).sample_counter
            await until(lambda: snapshot_of(host).sample_counter > counter + 300)
            assert gaps_above(host, HOST_SILENCE_S) > long_gaps
            assert host.command_gaps.values()["sum_s"] > total_s + 0.5
            assert snapshot_of(host).first_out_fault == 0
            assert host.link.lost_frames == 0

    asyncio.run(run())


def test_the_end_vents_within_a_second_and_closes_the_port(cable):
    async def run():
        board = cable.plug()
        async with running(cable) as host:
            await inflate(host)
            start_s = time.monotonic()
        assert time.monotonic() - start_s < VENTED_S + 1.0
        assert host.vent_verified
        assert board.state is BoardState.VENTED
        kinds = [type(message) for _, message in board.received]
        end = board.received[kinds.index(Vent) :]
        assert {m.mode for _, m in end if isinstance(m, Command)} == {Mode.VENT}
        assert end[0][0] < start_s + 0.5
        SerialPort(str(cable.path)).close()

    asyncio.run(run())


def test_the_end_of_a_vented_rig_does_not_wait(cable):
    async def run():
        cable.plug()
        async with running(cable) as host:
            await until(lambda: snapshot_of(host).state == "vented")
            start_s = time.monotonic()
        assert host.vent_verified
        assert time.monotonic() - start_s < VENTED_S

    asyncio.run(run())


def test_a_hold_during_the_end_is_never_sent(cable):
    async def run():
        board = cable.plug()
        async with running(cable) as host:
            await inflate(host)
            asyncio.get_running_loop().call_later(0.1, host.instrument.hold)
        assert host.vent_verified
        end = [m for t, m in board.received if t > board.messages(Vent)[0][0] and isinstance(m, Command)]
        assert {m.mode for m in end} == {Mode.VENT}

    asyncio.run(run())


class TestUnverifiedVent:
    """Tests of an end at which the sensor does not show an empty balloon: the log must not say "vented"."""

    def end_after(self, cable, caplog, disturb):
        async def run():
            board = cable.plug()
            async with running(cable) as host:
                await inflate(host)
                await disturb(board, host)
                caplog.set_level(logging.INFO)
                caplog.clear()
            return host

        host = asyncio.run(run())
        assert not host.vent_verified
        text = "\n".join(record.getMessage() for record in caplog.records)
        assert "vented" not in text
        return text

    @pytest.fixture(autouse=True)
    def brief_wait(self, monkeypatch):
        monkeypatch.setattr("pneuforce.instrument.service.host.last_vent.MAX_VENT_S", 0.6)

    def test_a_blocked_vent(self, cable, caplog):
        async def disturb(board, host):
            board.vent_blocked = True

        text = self.end_after(cable, caplog, disturb)
        assert "was sent, but not verified" in text
        assert "the sensor reads 8." in text

    def test_an_empty_sensor_behind_a_blocked_tube(self, cable, caplog):
        async def disturb(board, host):
            host.instrument.trip(Fault.OCCLUSION)

        assert "occlusion (fault 10)" in self.end_after(cable, caplog, disturb)

    def test_a_board_that_sends_no_samples(self, cable, caplog):
        async def disturb(board, host):
            board.mute = True
            await until(lambda: "link_lost" in snapshot_of(host).status)

        text = self.end_after(cable, caplog, disturb)
        assert "was sent, but not verified, because no samples" in text
        assert "board vents after 2 s" in text

    def test_a_cable_without_a_board(self, cable, caplog):
        async def disturb(board, host):
            cable.unplug()
            await until(lambda: host._port is None)

        text = self.end_after(cable, caplog, disturb)
        assert "could not be sent" in text
        assert "board vents after 2 s" in text

    def test_a_second_signal_ends_the_wait(self, cable, caplog, monkeypatch):
        monkeypatch.setattr("pneuforce.instrument.service.host.last_vent.MAX_VENT_S", TIMEOUT_S * 2)

        async def disturb(board, host):
            board.vent_blocked = True
            asyncio.get_running_loop().call_later(0.2, host.end_at_once)

        assert "not verified" in self.end_after(cable, caplog, disturb)


def test_the_end_vents_even_if_a_vent_was_delayed(cable):
    async def run():
        board = cable.plug()
        async with running(cable) as host:
            await inflate(host)
            host.instrument.trip(HostFault.LEASE_EXPIRED)
            host.instrument.vent_due_s = time.monotonic() + 5.0
        assert {m.mode for t, m in board.messages(Command)[-1:]} == {Mode.VENT}
        assert board.state is BoardState.VENTED

    asyncio.run(run())


def test_an_internal_error_vents(cable):
    async def run():
        board = cable.plug()
        host = Host(Session(Instrument(Settings())), str(cable.path))
        await host.connect(asyncio.Event())
        task = asyncio.create_task(host.run(asyncio.Event()))
        await inflate(host)
        host.instrument.tick = None  # causes an internal error in the loop
        with pytest.raises(TypeError):
            await asyncio.wait_for(task, TIMEOUT_S)
        assert board.state is BoardState.VENTED

    asyncio.run(run())


class TestNoBoard:
    """Tests of ports and boards that are rejected before any valve moves."""

    def connect(self, url):
        host = Host(Session(Instrument(Settings())), str(url))
        asyncio.run(host.connect(asyncio.Event()))

    def test_another_device_on_the_port_is_recognised_by_its_bytes(self, cable, monkeypatch):
        monkeypatch.setattr("pneuforce.instrument.service.host.host.HANDSHAKE_S", 0.5)
        board = cable.plug(version=9)
        board._receive = lambda data: None
        board.noise = b"$GPGGA,123519,4807.038,N\r\n\xa5\x5a\x33\x01"
        with pytest.raises(RigNotResponding, match=r"[0-9]+ bytes came, .* another device"):
            self.connect(cable.path)

    def test_a_silent_port_is_reported(self, cable, monkeypatch):
        monkeypatch.setattr("pneuforce.instrument.service.host.host.HANDSHAKE_S", 0.5)
        board = cable.plug()
        board._receive = lambda data: None
        with pytest.raises(RigNotResponding, match="no bytes came"):
            self.connect(cable.path)

    def test_another_version_is_rejected_and_receives_no_command(self, cable):
        board = cable.plug(version=9)
        with pytest.raises(ProtocolMismatch, match=r"version 9 .* version 1"):
            self.connect(cable.path)
        assert {type(message) for _, message in board.received} == {Identify}

    def test_a_board_with_another_silence_limit_is_rejected(self, cable):
        board = cable.plug(silence_ms=400)
        with pytest.raises(TimeoutMismatch, match=r"400 ms .* 250 ms"):
            self.connect(cable.path)
        assert {type(message) for _, message in board.received} == {Identify}

    def test_a_board_that_ignores_the_host_timeout_is_rejected_after_vent_commands_only(self, cable):
        board = cable.plug(host_timeout_ms=3000)
        board.ignores_host_timeout = True
        with pytest.raises(TimeoutMismatch, match=r"3000 ms .* 2000 ms"):
            self.connect(cable.path)
        assert {message.mode for _, message in board.messages(Command)} == {Mode.VENT}

    def test_a_port_in_use_is_busy(self, cable):
        cable.plug()
        with contextlib.closing(SerialPort(str(cable.path))), pytest.raises(PortBusy, match="in use"):
            self.connect(cable.path)

    def test_a_missing_port_is_named(self, tmp_path):
        with pytest.raises(PortUnavailable, match="no such port"):
            self.connect(tmp_path / "absent")

    @pytest.mark.parametrize("version", [1, 9])
    def test_after_a_rejection_the_port_is_free_again(self, cable, monkeypatch, version):
        monkeypatch.setattr("pneuforce.instrument.service.host.host.HANDSHAKE_S", 0.3)
        board = cable.plug(version=version)
        board.mute = True
        with pytest.raises((RigNotResponding, ProtocolMismatch)):
            self.connect(cable.path)
        SerialPort(str(cable.path)).close()


def test_the_host_timeout_of_an_earlier_host_is_replaced_before_inflation(cable):
    async def run():
        board = cable.plug(host_timeout_ms=9000)
        async with running(cable) as host:
            assert board.host_timeout_ms == 2000
            await inflate(host)

    asyncio.run(run())


class TestCable:
    """Tests of a cable that is unplugged and plugged in again."""

    def test_another_device_with_the_same_port_name_is_recognised_by_its_bytes(self, cable, caplog):
        async def run():
            cable.plug()
            async with running(cable) as host:
                await until(lambda: snapshot_of(host).sample_counter > 10)
                cable.unplug()
                other_device = cable.plug()
                other_device._receive = lambda data: None
                other_device.noise = b"$GPGGA,123519,4807.038,N"
                await until(lambda: "another device" in caplog.text, 2 * TIMEOUT_S)
                cable.unplug()
                cable.plug()
                await until(lambda: "link_lost" not in snapshot_of(host).status)

        asyncio.run(run())

    def test_the_host_reconnects_without_inflating(self, cable):
        async def run():
            cable.plug()
            async with running(cable) as host:
                await inflate(host)
                cable.unplug()
                await until(lambda: snapshot_of(host).state == "tripped")
                await asyncio.sleep(0.3)
                board = cable.plug()
                await until(lambda: "link_lost" not in snapshot_of(host).status, 3.0)
                await asyncio.sleep(0.2)
                assert host.reconnects == 1
                assert snapshot_of(host).state == "tripped"
                assert snapshot_of(host).first_out_fault == HostFault.LINK_LOST
                assert {m.mode for _, m in board.messages(Command)} == {Mode.VENT}

        asyncio.run(run())

    def test_without_a_cable_the_host_retries_with_growing_delays(self, cable, caplog):
        async def run():
            cable.plug()
            async with running(cable) as host:
                await until(lambda: snapshot_of(host).sample_counter > 10)
                cable.unplug()
                caplog.set_level(logging.INFO)
                tries, open_port = [], host._open_port
                host._open_port = lambda url: tries.append(url) or open_port(url)
                before_s = time.process_time()
                await asyncio.sleep(1.2)
                used_s = time.process_time() - before_s
                assert 2 <= len(tries) <= 4  # attempts at 0.1, 0.3, 0.7, 1.5 s …
                assert used_s < 0.4
                assert snapshot_of(host).age_s > 1.1
                assert sum("still down" in r.message for r in caplog.records) == 1

        asyncio.run(run())

    def test_the_same_error_is_logged_at_growing_intervals_and_a_new_one_at_once(self, caplog):
        now_s, logged_s, reason = 0.0, [], "no such port"

        def fail(url):
            raise PortUnavailable(url, reason)

        async def try_until(end_s):
            nonlocal now_s
            while now_s < end_s:
                before = len(caplog.records)
                await host._reopen()
                logged_s.extend([now_s] * (len(caplog.records) - before))
                now_s += 2.0

        host = Host(Session(Instrument(Settings())), "rig", fail, clock=lambda: now_s)
        asyncio.run(try_until(700.0))
        assert logged_s == [0.0, 10.0, 30.0, 70.0, 150.0, 310.0, 630.0]
        reason = "no permission"
        asyncio.run(try_until(710.0))
        assert logged_s[7:] == [700.0]

    def test_a_port_that_fails_right_after_opening_is_retried_with_growing_delays(self, cable):
        async def run():
            cable.plug()
            opened = []
            async with running(cable) as host:
                await until(lambda: snapshot_of(host).sample_counter > 10)

                def broken(url):
                    opened.append(time.monotonic())
                    dead = FakeBoard()
                    port = SerialPort(dead.path)
                    dead.end()
                    return port

                host._open_port = broken
                cable.unplug()
                await asyncio.sleep(1.2)
            gaps = [b - a for a, b in itertools.pairwise(opened)]
            assert 2 <= len(opened) <= 4
            assert gaps[-1] > 2 * FIRST_RETRY_S

        asyncio.run(run())

    def test_a_board_that_becomes_silent_gets_a_new_handshake(self, cable):
        async def run():
            board = cable.plug()
            async with running(cable) as host:
                await inflate(host)
                board.mute = True
                await until(lambda: "link_lost" in snapshot_of(host).status)
                board.received.clear()
                await until(lambda: board.messages(Identify))
                board.mute = False
                await until(lambda: "link_lost" not in snapshot_of(host).status)
                assert host.reconnects == 0
                assert snapshot_of(host).state == "tripped"

        asyncio.run(run())


def test_a_restarted_board_trips_and_its_setpoint_is_not_restored(cable):
    async def run():
        board = cable.plug(uptime_ms=60_000)
        async with running(cable) as host:
            await inflate(host)
            board.restart()
            await until(lambda: "board_reset" in snapshot_of(host).status)
            board.received.clear()
            await until(lambda: len(board.messages(Command)) > 5)
            assert {m.mode for _, m in board.messages(Command)} == {Mode.VENT}
            assert snapshot_of(host).state == "tripped"

    asyncio.run(run())


def test_events_of_the_board_are_logged_and_not_accumulated(cable, caplog):
    async def run():
        board = cable.plug()
        async with running(cable) as host:
            await until(lambda: snapshot_of(host).sample_counter > 10)
            caplog.set_level(logging.INFO)
            for _ in range(20):
                board._send(Event(0, BoardState.TRIPPED, BoardState.HOLDING, 5))
            line = "holding to tripped: burst (fault 5)"
            await until(lambda: sum(line in r.message for r in caplog.records) == 20)
            assert host.link.events == []

    asyncio.run(run())


def test_an_event_with_an_unknown_fault_is_logged_with_its_number(cable, caplog):
    async def run():
        board = cable.plug()
        async with running(cable) as host:
            caplog.set_level(logging.INFO)
            board._send(Event(0, BoardState.SETTLING, BoardState.HOLDING, 99))
            await until(lambda: any("settling: fault 99" in r.message for r in caplog.records))
            before = snapshot_of(host).sample_counter
            await until(lambda: snapshot_of(host).sample_counter > before + 10)

    asyncio.run(run())


def test_a_firmware_that_was_not_released_is_named_in_the_log_and_in_the_snapshot(cable, caplog):
    async def run():
        board = FakeBoard()
        board.image_crc = 0xDEADBEEF
        cable.path.symlink_to(board.path)
        board.start()
        async with running(cable) as host:
            await until(lambda: snapshot_of(host).firmware_origin == "unknown")
            assert "maintenance_required" in snapshot_of(host).status
        board.end()

    asyncio.run(run())
    (warning,) = [r.message for r in caplog.records if "not a released image" in r.message]
    assert "image DEADBEEF" in warning


def test_a_clock_out_of_tolerance_is_logged_once_with_its_error(caplog):
    host, board_us = Host(Session(Instrument(Settings())), "nowhere"), 0.0
    host.link.feed(encode(Hello(BoardKind.REAL, 0x100, 9000, 7, 250, 2000), 0), 0.0)
    for n in range(20_000):
        board_us += 2000 * (1.015 if n < 5000 else 1.0)
        host.link.feed(
            encode(Sample(round(board_us), 700, 5000, 0, BoardState.VENTED, 0, 0, 0, 0), n), n * 0.002
        )
        host._log_board_clock()
    (line,) = (record.message for record in caplog.records)
    assert "+1.5 %" in line


class TestOutputChannels:
    """Tests of the output channels, which are called for each sample and each tick."""

    def test_each_sample_is_passed_on_once_and_ticks_continue_without_samples(self, cable):
        class Channel:
            samples, ticks = 0, 0

            def on_sample(self, now_s):
                self.samples += 1

            def tick(self, now_s):
                self.ticks += 1

        async def run():
            board, channel = cable.plug(), Channel()
            async with running(cable) as host:
                host.channels.append(channel)
                before = host.instrument.sample_counter
                await until(lambda: channel.samples > 200)
                assert host.instrument.sample_counter - before == channel.samples
                board.mute = True
                await asyncio.sleep(0.05)
                samples, ticks, start_s = channel.samples, channel.ticks, time.monotonic()
                await until(lambda: channel.ticks >= ticks + 20)
                assert channel.samples == samples
                assert time.monotonic() - start_s > 0.15

        asyncio.run(run())

    def test_a_channel_that_fails_does_not_affect_the_others(self, cable):
        class Broken:
            def on_sample(self, now_s):
                raise RuntimeError("a bus is down")

            tick = on_sample

        class Good:
            samples = ticks = 0

            def on_sample(self, now_s):
                self.samples += 1

            def tick(self, now_s):
                self.ticks += 1

        async def run():
            cable.plug()
            good = Good()
            async with running(cable) as host:
                host.channels += [Broken(), good]
                await until(lambda: good.samples > 50)
                assert good.ticks > 0
                await until(lambda: snapshot_of(host).age_s < 0.1)

        logging.disable(logging.ERROR)
        try:
            asyncio.run(run())
        finally:
            logging.disable(logging.NOTSET)
