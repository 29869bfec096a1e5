"""Tests of the limit of open files: a limit that is too low is reported when the server starts."""

import subprocess
import sys

import pytest

#: This program runs in a separate process, because a lowered limit cannot be raised again.
PROGRAM = """
import asyncio, resource, sys
from pneuforce.registers.modbus.tcp import ModbusTcpServer, ModbusTcpOptions
from tests.registers.modbus.memory_source import MemorySource

soft, hard, connections = map(int, sys.argv[1:])
resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
server = ModbusTcpServer(MemorySource(), ModbusTcpOptions(port=0, max_connections=connections), {})

async def serve():
    try:
        await server.start()
    except OSError as error:
        return print(error.strerror)
    held = [await asyncio.open_connection("127.0.0.1", server.port) for _ in range(int(sys.argv[3]) // 3)]
    print(resource.getrlimit(resource.RLIMIT_NOFILE)[0], server.counters.clients)

asyncio.run(serve())
"""


def output(soft, hard, connections):
    arguments = [sys.executable, "-c", PROGRAM, *map(str, (soft, hard, connections))]
    return subprocess.run(arguments, capture_output=True, text=True, check=True).stdout.strip()


def test_the_soft_limit_is_raised_as_needed():
    assert output(60, 700, 90) == "666 30"


def test_a_sufficient_limit_is_not_changed():
    assert output(700, 700, 90) == "700 30"


@pytest.mark.parametrize("hard", [60, 665])
def test_a_hard_limit_that_is_too_low_is_reported(hard):
    message = output(60, hard, 90)
    assert all(text in message for text in ("90 connections", "666", str(hard), "ulimit -n"))
