"""Tests of the web process: the host restarts the process after each failure."""

import asyncio
import logging
import os
import signal
import socket
from contextlib import asynccontextmanager
from itertools import pairwise
from pathlib import Path

import pytest

from pneuforce.instrument.config import WebSection
from pneuforce.instrument.service.processes.web_process import WebProcess
from pneuforce.teststand.stack import free_port

SILENCE_S = 2.5  #: twice the longest time between two heartbeats on a busy machine
TIMEOUT_S = 20.0


@asynccontextmanager
async def running(folder, port, silence_s=60.0):
    web = WebProcess(WebSection(enabled=True, port=port), folder / "nobody.sock", silence_s=silence_s)
    web.begin()
    try:
        yield web
    finally:
        await web.close()


@pytest.mark.parametrize(
    ("host", "words"),
    [
        ("127.0.0.1", "http://127.0.0.1:80/"),
        ("::1", "http://[::1]:80/"),
        ("0.0.0.0", "port 80 of every"),
        ("::", "port 80 of every"),
    ],
)
def test_the_line_of_the_log_contains_only_an_address_that_a_browser_can_open(tmp_path, host, words):
    web = WebProcess(
        WebSection(enabled=True, host=host, allow=["10.0.0.1"], allow_plain_http=True), tmp_path / "socket"
    )
    web.port = 80
    assert words in web.serving_line()
    assert ("://" in web.serving_line()) is ("://" in words)


async def until(condition):
    async with asyncio.timeout(TIMEOUT_S):
        while not condition():
            await asyncio.sleep(0.02)


def web_pids():
    """Return the process ids of the web processes that this process has started."""
    pids = " ".join(file.read_text() for file in Path("/proc/self/task").glob("*/children")).split()
    return {int(pid) for pid in pids if command_of(pid).endswith(b"-m\0pneuforce.web\0")}


def command_of(pid):
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return b""


@pytest.fixture(autouse=True)
def logged(caplog):
    caplog.set_level(logging.INFO, "pneuforce")
    return lambda: caplog.messages


def test_a_process_that_hangs_is_ended_and_restarted(tmp_path, logged):
    async def run():
        async with running(tmp_path, free_port(), SILENCE_S) as web:
            await until(lambda: web.port)
            (first,) = web_pids()
            os.kill(first, signal.SIGSTOP)
            await until(lambda: not web.port)
            await until(lambda: web.port)
            (second,) = web_pids()
            assert second != first
        assert web_pids() == set()

    asyncio.run(run())
    assert len([line for line in logged() if "2.5 s" in line and "restarted" in line]) == 1


def test_a_process_that_works_is_not_restarted(tmp_path):
    async def run():
        async with running(tmp_path, free_port(), SILENCE_S) as web:
            await until(lambda: web.port)
            before = web_pids()
            await asyncio.sleep(2 * SILENCE_S)
            assert web_pids() == before

    asyncio.run(run())


def test_a_port_in_use_is_logged_once_and_tried_until_it_is_free(tmp_path, logged):
    async def run():
        with socket.create_server(("127.0.0.1", 0)) as taken:
            port = taken.getsockname()[1]
            async with running(tmp_path, port) as web:
                assert await web.first_port() is None
                await until(logged)
                await until(web_pids)  # the second attempt
                await until(lambda: not web_pids())
                assert len(logged()) == 1
                taken.close()
                await until(lambda: web.port == port)
        return port

    port = asyncio.run(run())
    first, second = logged()
    assert f"127.0.0.1:{port}" in first
    assert "[web] port" in first
    assert f"http://127.0.0.1:{port}/" in second


def test_a_process_that_cannot_be_started_is_logged_with_the_reason(tmp_path, logged, monkeypatch):
    monkeypatch.setattr("sys.executable", str(tmp_path / "no python"))

    async def run():
        async with running(tmp_path, free_port()) as web:
            assert await web.first_port() is None

    asyncio.run(run())
    (line,) = logged()
    assert "No such file or directory" in line


def test_a_process_that_always_ends_is_restarted_with_growing_delays(tmp_path, monkeypatch):
    starts, program = tmp_path / "starts", tmp_path / "python"
    program.write_text(f"#!/bin/sh\ndate +%s.%N >> {starts}\n")
    program.chmod(0o700)
    monkeypatch.setattr("sys.executable", str(program))
    monkeypatch.setattr("pneuforce.instrument.service.processes.service_process.FIRST_WAIT_S", 0.05)

    def starts_s():
        return list(map(float, starts.read_text().split())) if starts.exists() else []

    async def run():
        async with running(tmp_path, free_port()):
            await until(lambda: len(starts_s()) == 6)

    asyncio.run(run())
    *_, fourth_s, fifth_s = (after - before for before, after in pairwise(starts_s()))
    assert fourth_s > 0.3
    assert fifth_s > 0.7


def test_a_host_that_ends_while_the_process_hangs_ends_the_process(tmp_path):
    async def run():
        async with running(tmp_path, free_port()) as web:
            await until(lambda: web.port)
            (pid,) = web_pids()
            os.kill(pid, signal.SIGSTOP)
        assert not Path(f"/proc/{pid}").exists()

    asyncio.run(run())
