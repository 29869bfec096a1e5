"""The host on a real pty: a small board in a thread at the other end, a symlink for the cable."""

import asyncio
import contextlib
import itertools
import logging
import time

import pytest

from instrument.core import Instrument
from instrument.coupling import Coupling
from instrument.errors import PortBusy, PortUnavailable, ProtocolMismatch, RigSilent, TimeOutMismatch
from instrument.faults import HostFault
from instrument.host import BACK_OFF_S, Host
from instrument.rig.frames import (
    BoardKind,
    BoardState,
    Command,
    Event,
    Hello,
    Identify,
    Mode,
    Sample,
    Vent,
    encode,
)
from instrument.rig.port import SerialPort
from instrument.settings import Settings
from tests.instrument.driving import HOLD_8, PLC, VENT
from tests.instrument.plugged import Board, Cable

PATIENCE_S = 5.0


@pytest.fixture
def cable(tmp_path):
    cable = Cable(tmp_path / "rig")
    yield cable
    for board in cable.boards:
        board.end()


@contextlib.asynccontextmanager
async def running(cable):
    """A host that is connected and runs; vented and ended on the way out."""
    host, stop = Host(Coupling(Instrument(Settings())), str(cable.path)), asyncio.Event()
    await host.connect(asyncio.Event())
    task = asyncio.create_task(host.run(stop))
    try:
        yield host
    finally:
        stop.set()
        await asyncio.wait_for(task, PATIENCE_S)


async def until(condition, patience_s=PATIENCE_S):
    deadline_s = time.monotonic() + patience_s
    while not condition():
        assert time.monotonic() < deadline_s, "what was waited for did not come"
        await asyncio.sleep(0.005)


class SentByBeat:
    """A face that notes the sequence of the last command sent, at each beat."""

    def __init__(self, host):
        self.sequences, self._link = [], host.link
        host.faces.append(self)

    def on_sample(self, now_s):
        pass

    def tick(self, now_s):
        self.sequences.append(self._link.command_sequence)


def see(host):
    return host.instrument.snapshot(PLC, time.monotonic())


async def inflate(host):
    await until(lambda: host.instrument.chain.zero.taken)
    for request in (VENT, HOLD_8):
        assert host.instrument.write(PLC, request, time.monotonic()) == "none"
    await until(lambda: see(host).state == "holding")


def test_it_greets_measures_and_inflates(cable):
    async def story():
        board = cable.plug()
        async with running(cable) as host:
            await inflate(host)
            assert see(host).setpoint_kpa == 8.0
            assert {"simulated", "holding"} <= see(host).status
            assert host.link.lost_frames == 0
        kinds = [type(message) for _, message in board.heard]
        assert kinds[0] is Identify
        assert Identify not in kinds[kinds.index(Command) :]

    asyncio.run(story())


def test_the_board_is_kept_alive_and_heard_of_every_change_at_once(cable):
    async def story():
        board = cable.plug()
        async with running(cable) as host:
            await inflate(host)
            sent = SentByBeat(host)
            await until(lambda: len(sent.sequences) > 50)
            # a beat takes 10 ms at least: 50 ms are five of them, fewer on a busy machine
            assert max(len(list(same)) for _, same in itertools.groupby(sent.sequences)) <= 7
            for setpoint_pa in (6000, 7000, 6500, 7500, 6000):
                beats, sequence = len(sent.sequences), host.link.command_sequence
                change = {"setpoint_requested_kpa": setpoint_pa / 1e3}
                assert host.instrument.write(PLC, change, time.monotonic()) == "none"
                await until(lambda beats=beats: len(sent.sequences) > beats)
                assert sent.sequences[beats] == sequence + 1
            await until(lambda: board.messages(Command)[-1][1].setpoint_pa == 6000)

    asyncio.run(story())


def test_what_came_while_the_process_was_stopped_is_used_with_its_age(cable):
    async def story():
        board = cable.plug()
        async with running(cable) as host:
            await until(lambda: see(host).sample_counter > 100)
            ages, take = [], host.instrument.take
            host.instrument.take = lambda raw: ages.append(time.monotonic() - raw.t_s) or take(raw)
            first, deadline_s = board._samples, time.monotonic() + PATIENCE_S
            while board._samples < first + 75 and time.monotonic() < deadline_s:
                time.sleep(0.01)  # the whole loop stands still
            await until(lambda: len(ages) > 75)
            await until(lambda: see(host).age_s < 0.05)
            assert max(ages) > 0.1
            assert host.link.lost_frames == 0

    asyncio.run(story())


def test_a_stop_longer_than_the_allowed_silence_trips_though_nothing_was_lost(cable):
    async def story():
        cable.plug()
        async with running(cable) as host:
            await inflate(host)
            time.sleep(0.3)  # the whole loop stands still
            await until(lambda: see(host).first_fault == HostFault.LINK_LOST)

    asyncio.run(story())


def test_it_ends_venting_within_a_second_and_gives_the_port_back(cable):
    async def story():
        board = cable.plug()
        async with running(cable) as host:
            await inflate(host)
            start_s = time.monotonic()
        assert time.monotonic() - start_s < 1.0
        assert board.state is BoardState.VENTED
        assert [type(m) for _, m in board.heard[-2:]] == [Vent, Command]
        assert board.heard[-1][1].mode == Mode.VENT
        SerialPort(str(cable.path)).close()

    asyncio.run(story())


def test_it_ends_venting_even_when_a_vent_was_being_put_off(cable):
    async def story():
        board = cable.plug()
        async with running(cable) as host:
            await inflate(host)
            host.instrument.trip(HostFault.LEASE_EXPIRED)
            host.instrument._vent_due_s = time.monotonic() + 5.0
        assert {m.mode for t, m in board.messages(Command)[-1:]} == {Mode.VENT}
        assert board.state is BoardState.VENTED

    asyncio.run(story())


def test_whatever_ends_it_vents(cable):
    async def story():
        board = cable.plug()
        host = Host(Coupling(Instrument(Settings())), str(cable.path))
        await host.connect(asyncio.Event())
        task = asyncio.create_task(host.run(asyncio.Event()))
        await inflate(host)
        host.instrument.tick = None  # our own mistake, in the loop itself
        with pytest.raises(TypeError):
            await asyncio.wait_for(task, PATIENCE_S)
        assert board.state is BoardState.VENTED

    asyncio.run(story())


class TestNoBoard:
    """What is refused before anything moves."""

    def connect(self, url):
        host = Host(Coupling(Instrument(Settings())), str(url))
        asyncio.run(host.connect(asyncio.Event()))

    def test_another_device_on_the_port_is_told_by_the_bytes_it_sends(self, cable, monkeypatch):
        monkeypatch.setattr("instrument.host.GREETING_S", 0.5)
        board = cable.plug(version=9)
        board._listen = lambda data: None
        board.noise = b"$GPGGA,123519,4807.038,N\r\n\xa5\x5a\x33\x01"
        with pytest.raises(RigSilent, match=r"no greeting .* [0-9]+ bytes came, none .* another device"):
            self.connect(cable.path)

    def test_a_silent_port_is_told(self, cable, monkeypatch):
        monkeypatch.setattr("instrument.host.GREETING_S", 0.5)
        board = cable.plug()
        board._listen = lambda data: None
        with pytest.raises(RigSilent, match="nothing came at all"):
            self.connect(cable.path)

    def test_another_version_is_refused_and_hears_no_command(self, cable):
        board = cable.plug(version=9)
        with pytest.raises(ProtocolMismatch, match=r"version 9 .* version 1: .*no valve was moved"):
            self.connect(cable.path)
        assert {type(message) for _, message in board.heard} == {Identify}

    def test_a_board_that_shuts_its_inlet_later_than_the_host_counts_on_is_refused(self, cable):
        board = cable.plug(silence_ms=400)
        with pytest.raises(TimeOutMismatch, match=r"shuts its inlet .* 400 ms, this host counts on 250 ms"):
            self.connect(cable.path)
        assert {type(message) for _, message in board.heard} == {Identify}

    def test_a_board_that_does_not_take_over_when_to_vent_is_refused_having_been_told_to_vent_only(
        self, cable
    ):
        board = cable.plug(vent_after_ms=3000)
        board.deaf_to_time_outs = True
        with pytest.raises(TimeOutMismatch, match=r"vents .* 3000 ms, this host counts on 2000 ms"):
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
    def test_after_a_refusal_the_port_is_free_again(self, cable, monkeypatch, version):
        monkeypatch.setattr("instrument.host.GREETING_S", 0.3)
        board = cable.plug(version=version)
        board.mute = True
        with pytest.raises((RigSilent, ProtocolMismatch)):
            self.connect(cable.path)
        SerialPort(str(cable.path)).close()


def test_a_board_that_another_host_told_otherwise_agrees_before_it_may_inflate(cable):
    async def story():
        board = cable.plug(vent_after_ms=9000)
        async with running(cable) as host:
            assert board.vent_after_ms == 2000
            await inflate(host)

    asyncio.run(story())


class TestCable:
    """The cable is pulled, and put back under another name."""

    def test_another_device_that_takes_the_ports_name_is_told_by_what_it_sends(self, cable, caplog):
        async def story():
            cable.plug()
            async with running(cable) as host:
                await until(lambda: see(host).sample_counter > 10)
                cable.pull()
                stranger = cable.plug()
                stranger._listen = lambda data: None
                stranger.noise = b"$GPGGA,123519,4807.038,N"
                await until(lambda: "another device on that port" in caplog.text, 2 * PATIENCE_S)
                cable.pull()
                cable.plug()
                await until(lambda: "link_lost" not in see(host).status)

        asyncio.run(story())

    def test_it_reconnects_and_does_not_inflate_by_itself(self, cable):
        async def story():
            cable.plug()
            async with running(cable) as host:
                await inflate(host)
                cable.pull()
                await until(lambda: see(host).state == "tripped")
                await asyncio.sleep(0.3)
                board = cable.plug()
                await until(lambda: "link_lost" not in see(host).status, 3.0)
                await asyncio.sleep(0.2)
                assert host.reconnects == 1
                assert see(host).state == "tripped"
                assert see(host).first_fault == HostFault.LINK_LOST
                assert {m.mode for _, m in board.messages(Command)} == {Mode.VENT}

        asyncio.run(story())

    def test_while_it_is_out_the_host_neither_spins_nor_gives_up(self, cable, caplog):
        async def story():
            cable.plug()
            async with running(cable) as host:
                await until(lambda: see(host).sample_counter > 10)
                cable.pull()
                caplog.set_level(logging.INFO)
                tries, open_port = [], host._open_port
                host._open_port = lambda url: tries.append(url) or open_port(url)
                before_s = time.process_time()
                await asyncio.sleep(1.2)
                used_s = time.process_time() - before_s
                assert 2 <= len(tries) <= 4  # 0.1, 0.3, 0.7, 1.5 s …
                assert used_s < 0.4
                assert see(host).age_s > 1.1
                assert sum("still down" in r.message for r in caplog.records) == 1

        asyncio.run(story())

    def test_the_same_trouble_is_told_at_growing_intervals_and_another_at_once(self, caplog):
        now_s, told, reason = 0.0, [], "no such port"

        def refuse(url):
            raise PortUnavailable(url, reason)

        async def try_until(end_s):
            nonlocal now_s
            while now_s < end_s:
                before = len(caplog.records)
                await host._reopen()
                told.extend([now_s] * (len(caplog.records) - before))
                now_s += 2.0

        host = Host(Coupling(Instrument(Settings())), "rig", refuse, clock=lambda: now_s)
        asyncio.run(try_until(700.0))
        assert told == [0.0, 10.0, 30.0, 70.0, 150.0, 310.0, 630.0]
        reason = "no permission"
        asyncio.run(try_until(710.0))
        assert told[7:] == [700.0]

    def test_a_port_that_opens_and_breaks_at_once_is_not_tried_ever_faster(self, cable):
        async def story():
            cable.plug()
            opened = []
            async with running(cable) as host:
                await until(lambda: see(host).sample_counter > 10)

                def broken(url):
                    opened.append(time.monotonic())
                    dead = Board()
                    port = SerialPort(dead.path)
                    dead.end()
                    return port

                host._open_port = broken
                cable.pull()
                await asyncio.sleep(1.2)
            gaps = [b - a for a, b in itertools.pairwise(opened)]
            assert 2 <= len(opened) <= 4
            assert gaps[-1] > 2 * BACK_OFF_S[0]

        asyncio.run(story())

    def test_a_board_that_falls_silent_is_greeted_again(self, cable):
        async def story():
            board = cable.plug()
            async with running(cable) as host:
                await inflate(host)
                board.mute = True
                await until(lambda: "link_lost" in see(host).status)
                board.heard.clear()
                await until(lambda: board.messages(Identify))
                board.mute = False
                await until(lambda: "link_lost" not in see(host).status)
                assert host.reconnects == 0
                assert see(host).state == "tripped"

        asyncio.run(story())


def test_a_restarted_board_trips_and_its_setpoint_is_not_restored(cable):
    async def story():
        board = cable.plug(uptime_ms=60_000)
        async with running(cable) as host:
            await inflate(host)
            board.restart()
            await until(lambda: "board_reset" in see(host).status)
            board.heard.clear()
            await until(lambda: len(board.messages(Command)) > 5)
            assert {m.mode for _, m in board.messages(Command)} == {Mode.VENT}
            assert see(host).state == "tripped"

    asyncio.run(story())


def test_the_boards_events_are_logged_and_not_piled_up(cable, caplog):
    async def story():
        board = cable.plug()
        async with running(cable) as host:
            await until(lambda: see(host).sample_counter > 10)
            caplog.set_level(logging.INFO)
            for _ in range(20):
                board._send(Event(0, BoardState.TRIPPED, BoardState.HOLDING, 5))
            await until(lambda: sum("holding to tripped (burst)" in r.message for r in caplog.records) == 20)
            assert host.link.events == []

    asyncio.run(story())


def test_an_event_with_a_fault_that_only_a_later_board_knows_is_told_by_its_number(cable, caplog):
    async def story():
        board = cable.plug()
        async with running(cable) as host:
            caplog.set_level(logging.INFO)
            board._send(Event(0, BoardState.SETTLING, BoardState.HOLDING, 99))
            await until(lambda: any("settling (fault 99)" in r.message for r in caplog.records))
            before = see(host).sample_counter
            await until(lambda: see(host).sample_counter > before + 10)

    asyncio.run(story())


def test_a_clock_that_is_off_is_told_once_and_so_is_its_end(caplog):
    host, board_us = Host(Coupling(Instrument(Settings())), "nowhere"), 0.0
    host.link.feed(encode(Hello(BoardKind.REAL, 0x100, 9000, 7, 250, 2000), 0), 0.0)
    for n in range(20_000):
        board_us += 2000 * (1.015 if n < 5000 else 1.0)
        host.link.feed(
            encode(Sample(round(board_us), 700, 5000, 0, BoardState.VENTED, 0, 0, 0, 0), n), n * 0.002
        )
        host._log_clock()
    assert [record.message for record in caplog.records] == [
        "the board's clock is +1.5% off; all its times are by it",
        "the board's clock is as it should be again; all its times are by it",
    ]


class TestFaces:
    """The buses that are told of each sample."""

    def test_each_sample_is_told_once_and_time_goes_on_without_samples(self, cable):
        class Face:
            samples, ticks = 0, 0

            def on_sample(self, now_s):
                self.samples += 1

            def tick(self, now_s):
                self.ticks += 1

        async def story():
            board, face = cable.plug(), Face()
            async with running(cable) as host:
                host.faces.append(face)
                before = host.instrument.sample_counter
                await until(lambda: face.samples > 200)
                assert host.instrument.sample_counter - before == face.samples
                board.mute = True
                await asyncio.sleep(0.05)
                samples, ticks, start_s = face.samples, face.ticks, time.monotonic()
                await until(lambda: face.ticks >= ticks + 20)
                assert face.samples == samples
                assert time.monotonic() - start_s > 0.15

        asyncio.run(story())

    def test_a_face_that_fails_costs_no_sample_and_no_tick_of_the_others(self, cable):
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

        async def story():
            cable.plug()
            good = Good()
            async with running(cable) as host:
                host.faces += [Broken(), good]
                await until(lambda: good.samples > 50)
                assert good.ticks > 0
                await until(lambda: see(host).age_s < 0.1)

        logging.disable(logging.ERROR)
        try:
            asyncio.run(story())
        finally:
            logging.disable(logging.NOTSET)
