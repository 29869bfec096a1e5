"""A process that may open few files: told at start, not when nobody gets in any more."""

import subprocess
import sys

import pytest

#: In a process of its own, for a limit that is lowered cannot be raised again.
PROGRAM = """
import asyncio, resource, sys
from registers.modbus.tcp import ModbusTcpServer, Options
from tests.registers.modbus.memory import MemorySource

soft, hard, connections = map(int, sys.argv[1:])
resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
server = ModbusTcpServer(MemorySource(), Options(port=0, most_connections=connections), {})

async def serve():
    try:
        await server.start()
    except OSError as error:
        return print(error.strerror)
    held = [await asyncio.open_connection("127.0.0.1", server.port) for _ in range(int(sys.argv[3]) // 3)]
    print(resource.getrlimit(resource.RLIMIT_NOFILE)[0], server.counters.clients)

asyncio.run(serve())
"""


def said(soft, hard, connections):
    arguments = [sys.executable, "-c", PROGRAM, *map(str, (soft, hard, connections))]
    return subprocess.run(arguments, capture_output=True, text=True, check=True).stdout.strip()


def test_what_is_allowed_to_be_opened_is_taken():
    assert said(60, 700, 90) == "666 30"


def test_a_limit_that_suffices_is_left_alone():
    assert said(700, 700, 90) == "700 30"


@pytest.mark.parametrize("hard", [60, 665])
def test_more_connections_than_files_are_refused_in_a_sentence(hard):
    assert said(60, hard, 90) == (
        f"90 connections need up to 666 open files, and {hard} are allowed (ulimit -n)"
    )
