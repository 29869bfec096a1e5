"""The page as the host keeps it, with the page's real process: whatever becomes of it, it comes back."""

import asyncio
import logging
import os
import signal
import socket
from contextlib import asynccontextmanager
from itertools import pairwise
from pathlib import Path

import pytest

from instrument.cli.page_face import PageFace
from instrument.config import Page
from teststand.stack import free_port

SILENCE_S = 2.5  #: twice what it is silent for at most, as it is on a busy machine
SOON_S = 20.0


@asynccontextmanager
async def kept(folder, port, silence_s=60.0):
    face = PageFace(Page(enabled=True, port=port), folder / "nobody.sock", silence_s)
    face.begin()
    try:
        yield face
    finally:
        await face.close()


async def until(so):
    async with asyncio.timeout(SOON_S):
        while not so():
            await asyncio.sleep(0.02)


def pages():
    """Processes of a page that this process has begun."""
    pids = " ".join(file.read_text() for file in Path("/proc/self/task").glob("*/children")).split()
    return {int(pid) for pid in pids if command_of(pid).endswith(b"-m\0page\0")}


def command_of(pid):
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return b""


@pytest.fixture(autouse=True)
def told(caplog):
    caplog.set_level(logging.INFO, "pneuforce")
    return lambda: caplog.messages


def test_a_page_that_hangs_is_ended_and_begun_again(tmp_path, told):
    async def hang():
        async with kept(tmp_path, free_port(), SILENCE_S) as face:
            await until(lambda: face.port)
            (first,) = pages()
            os.kill(first, signal.SIGSTOP)
            await until(lambda: not face.port)
            await until(lambda: face.port)
            (second,) = pages()
            assert second != first
        assert pages() == set()

    asyncio.run(hang())
    assert [line for line in told() if "said nothing" in line] == [
        "the page said nothing for 2.5 s, so it was ended; it is tried again"
    ]


def test_a_page_that_goes_round_is_left_alone(tmp_path):
    async def wait():
        async with kept(tmp_path, free_port(), SILENCE_S) as face:
            await until(lambda: face.port)
            before = pages()
            await asyncio.sleep(2 * SILENCE_S)
            assert pages() == before

    asyncio.run(wait())


def test_a_taken_port_is_told_once_and_tried_until_it_is_free(tmp_path, told):
    async def come_later():
        with socket.create_server(("127.0.0.1", 0)) as taken:
            port = taken.getsockname()[1]
            async with kept(tmp_path, port) as face:
                assert await face.tried() is None
                await until(told)
                await until(pages)  # a second time
                await until(lambda: not pages())
                assert len(told()) == 1
                taken.close()
                await until(lambda: face.port == port)
        return port

    port = asyncio.run(come_later())
    why = f"cannot listen on 127.0.0.1:{port}: it is in use by another program; change [page] port"
    assert told() == [f"the page {why}; it is tried again", f"the page is at http://127.0.0.1:{port}/"]


def test_a_page_that_cannot_be_begun_is_told_in_a_sentence(tmp_path, told, monkeypatch):
    monkeypatch.setattr("sys.executable", str(tmp_path / "no python"))

    async def begin():
        async with kept(tmp_path, free_port()) as face:
            assert await face.tried() is None

    asyncio.run(begin())
    (line,) = told()
    assert line == "the page cannot be begun: No such file or directory; it is tried again"


def test_a_page_that_always_ends_is_begun_later_and_later(tmp_path, monkeypatch):
    begun, program = tmp_path / "begun", tmp_path / "python"
    program.write_text(f"#!/bin/sh\ndate +%s.%N >> {begun}\n")
    program.chmod(0o700)
    monkeypatch.setattr("sys.executable", str(program))
    monkeypatch.setattr("instrument.cli.page_face.AGAIN_S", 0.05)

    def begun_s():
        return list(map(float, begun.read_text().split())) if begun.exists() else []

    async def go_on_failing():
        async with kept(tmp_path, free_port()):
            await until(lambda: len(begun_s()) == 6)

    asyncio.run(go_on_failing())
    *_, fourth_s, fifth_s = (after - before for before, after in pairwise(begun_s()))
    assert fourth_s > 0.3
    assert fifth_s > 0.7


def test_a_host_that_ends_while_its_page_hangs_leaves_none_behind(tmp_path):
    async def end():
        async with kept(tmp_path, free_port()) as face:
            await until(lambda: face.port)
            (page,) = pages()
            os.kill(page, signal.SIGSTOP)
        assert not Path(f"/proc/{page}").exists()

    asyncio.run(end())
