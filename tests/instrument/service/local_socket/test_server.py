"""Tests of the local server: slow clients, too many clients, failed recorders, disconnections."""

import asyncio
import signal
import socket
import sys
from asyncio.subprocess import DEVNULL
from contextlib import asynccontextmanager, suppress

import pytest

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.audit.audit_logger import AuditLogger, NullAuditSink
from pneuforce.instrument.config import Configuration
from pneuforce.instrument.core.session import Session
from pneuforce.instrument.recording.broadcaster import MAX_BACKLOG_BYTES, EntryBroadcaster
from pneuforce.instrument.recording.schema import EndReason
from pneuforce.instrument.service.local_socket.recorder import NO_END
from pneuforce.instrument.service.local_socket.server import HEALTH_S, MAX_CLIENTS, LocalServer
from pneuforce.instrument.stream.entry import EntryDecoder, EntryKind, StreamEntry, encode, json_entry
from tests.instrument.instrument_harness import InstrumentHarness
from tests.instrument.recording.recording_files import read_contents

TIMEOUT_S = 10.0


@asynccontextmanager
async def serving(folder, sink=None):
    """Run a local server with its socket in the folder. Yield the server and its instrument's harness.

    The server writes the event log to `sink`.
    """
    broadcaster, harness = EntryBroadcaster(), InstrumentHarness.zeroed()
    session = Session(harness.instrument, broadcaster)
    source = AuditLogger(session, sink or NullAuditSink())
    server = LocalServer(session, source, broadcaster, Configuration(), lambda now_s: {})
    await server.open(folder / "s")
    try:
        yield server, harness
    finally:
        await server.close("")


class Client:
    """Client of the local socket."""

    def __init__(self, reader, writer):
        self._reader, self._writer, self._decoder = reader, writer, EntryDecoder()

    @classmethod
    async def connect(cls, folder, subscription=None):
        client = cls(*await asyncio.open_unix_connection(str(folder / "s")))
        if subscription:
            client.send(json_entry(EntryKind.SUBSCRIBE, 0.0, {"want": subscription}))
        return client

    def send(self, entry):
        self._writer.write(encode(entry))

    async def receive(self, kind):
        """Return the next entry of a kind."""
        async with asyncio.timeout(TIMEOUT_S):
            while True:
                data = await self._reader.read(65536)
                assert data, "the connection has ended"
                for entry in self._decoder.feed(data):
                    if entry.kind is kind:
                        return entry

    async def expect_disconnection(self):
        async with asyncio.timeout(TIMEOUT_S):
            with suppress(ConnectionError):
                assert await self._reader.read() == b""

    def close(self):
        self._writer.close()


async def until(condition):
    async with asyncio.timeout(TIMEOUT_S):
        while not condition():
            await asyncio.sleep(0.001)


def is_begun(file):
    try:
        return bool(read_contents(file).metadata)
    except ConfigurationError:
        return False


@pytest.mark.parametrize(("subscription", "recording_down"), [("record", True), ("web", False)])
def test_a_slow_client_is_disconnected_and_a_lost_recorder_is_reported(
    tmp_path, subscription, recording_down
):
    async def run():
        async with serving(tmp_path) as (server, harness):
            with socket.socket(socket.AF_UNIX) as silent:
                silent.connect(str(tmp_path / "s"))
                silent.sendall(encode(json_entry(EntryKind.SUBSCRIBE, 0.0, {"want": subscription})))
                await until(lambda: server.broadcaster.subscribers)
                for _ in range(2 * MAX_BACKLOG_BYTES // 100_000):
                    server.broadcaster.record(EntryKind.EVENT, harness.now_s, bytes(100_000))
                    server.tick(harness.now_s)
                    await asyncio.sleep(0)
                assert not server.clients
                assert not server.broadcaster.subscribers
                assert harness.instrument.recording_down == recording_down
                assert ("maintenance_required" in harness.snapshot().status) == recording_down

    asyncio.run(run())


def test_the_recording_of_a_recorder_that_was_too_slow_ends_with_both_possible_causes(tmp_path):
    file, socket_path = tmp_path / "a.recording", tmp_path / "s"
    record = ("-P", "-m", "pneuforce", "record", str(file), "--socket", str(socket_path))
    event = {"at": "", "kind": "test", "much": "x" * 100_000}

    async def run():
        async with serving(tmp_path) as (server, harness):
            recorder = await asyncio.create_subprocess_exec(sys.executable, *record, stderr=DEVNULL)
            await until(lambda: server.recording)
            server.tick(harness.now_s)
            await until(lambda: is_begun(file))
            recorder.send_signal(signal.SIGSTOP)
            for _ in range(2 * MAX_BACKLOG_BYTES // 100_000):
                server.broadcaster.publish_json(EntryKind.EVENT, harness.now_s, event)
                server.tick(harness.now_s)
                await asyncio.sleep(0)
            assert not server.recording
            recorder.send_signal(signal.SIGCONT)
            assert await recorder.wait() == 1
            assert server.recording_error

    asyncio.run(run())
    ending = read_contents(file).ending
    assert (ending.how, ending.why) == (EndReason.CUT_OFF, NO_END)


def test_too_many_clients_are_rejected_until_one_disconnects(tmp_path):
    async def run():
        async with serving(tmp_path) as (server, _):
            clients = [await Client.connect(tmp_path) for _ in range(MAX_CLIENTS)]
            await until(lambda: len(server.clients) == MAX_CLIENTS)
            await (await Client.connect(tmp_path, "web")).expect_disconnection()
            assert len(server.clients) == MAX_CLIENTS
            clients[0].close()
            await until(lambda: len(server.clients) < MAX_CLIENTS)
            web = await Client.connect(tmp_path, "web")
            await until(lambda: server.broadcaster.subscribers)
            server.tick(0.0)
            assert (await web.receive(EntryKind.HEADER)).json_body
            for client in (*clients[1:], web):
                client.close()

    asyncio.run(run())


@pytest.mark.parametrize("subscription", ["record", "web"])
def test_a_client_that_disconnected_has_no_subscription(tmp_path, subscription):
    async def run():
        async with serving(tmp_path) as (server, _):
            client = await Client.connect(tmp_path, subscription)
            await until(lambda: server.broadcaster.subscribers)
            client.close()
            await until(lambda: not server.clients)
            assert server.broadcaster.subscribers == []

    asyncio.run(run())


def test_the_web_process_receives_the_reason_of_a_stop_until_the_next_recording(tmp_path):
    async def run():
        async with serving(tmp_path) as (server, _):
            web, recorder = [await Client.connect(tmp_path, name) for name in ("web", "record")]
            await until(lambda: len(server.broadcaster.subscribers) == 2)

            async def health(now_s):
                server.tick(now_s)
                return (await web.receive(EntryKind.HEALTH)).json_body["recording"]

            assert await health(HEALTH_S) == {"on": True, "trouble": ""}
            recorder.send(StreamEntry(EntryKind.FAILURE, 0.0, b"the disk is full"))
            recorder.close()
            await until(lambda: not server.recording)
            assert await health(2 * HEALTH_S) == {"on": False, "trouble": "the disk is full"}
            next_recorder = await Client.connect(tmp_path, "record")
            await until(lambda: server.recording)
            assert await health(3 * HEALTH_S) == {"on": True, "trouble": ""}
            next_recorder.close()
            web.close()

    asyncio.run(run())
