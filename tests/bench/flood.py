"""Clients that send garbage without pause: `python -m tests.bench.flood PORT CLIENTS`."""

import asyncio
import os
import random
import sys

REQUEST = bytes.fromhex("0001 0000 0006 01 04 0000 007d")


async def peer(port, chance):
    """Send random bytes, requests with flipped bits, and valid requests without end."""
    while True:
        try:
            reader, writer = await asyncio.open_connection("127.0.0.1", port)
            while not reader.at_eof():
                writer.write(_bytes(chance))
                await writer.drain()
                await asyncio.wait_for(reader.read(65536), 1.0)
            writer.close()
        except (OSError, TimeoutError):
            await asyncio.sleep(0)


def _bytes(chance):
    kind = chance.random()
    if kind < 0.3:
        return os.urandom(chance.randrange(1, 2000))
    request = bytearray(REQUEST * chance.randrange(1, 60))
    if kind < 0.8:
        request[chance.randrange(len(request))] ^= 1 << chance.randrange(8)
    return bytes(request)


async def main(port, peers):
    print("ready", flush=True)
    await asyncio.gather(*(peer(port, random.Random(n)) for n in range(peers)))


if __name__ == "__main__":
    asyncio.run(main(*map(int, sys.argv[1:])))
