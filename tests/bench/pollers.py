"""Modbus clients that poll at a fixed rate: `python -m tests.bench.pollers PORT CLIENTS HZ SECONDS`.

The program prints one JSON line: the round-trip times [ms] of reads of registers 0–35 with function 04.
"""

import asyncio
import json
import sys
import time

REQUEST = bytes.fromhex("0001 0000 0006 01 04 0000 0024")
ANSWER_BYTES = 9 + 72


async def poll(port, period_s, until_s, offset_s):
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    trips_ms, due_s = [], time.monotonic() + offset_s
    while due_s < until_s:
        await asyncio.sleep(max(0.0, due_s - time.monotonic()))
        begun_s = time.monotonic()
        writer.write(REQUEST)
        await reader.readexactly(ANSWER_BYTES)
        trips_ms.append((time.monotonic() - begun_s) * 1e3)
        due_s += period_s
    writer.close()
    return trips_ms


async def main(port, clients, hz, seconds):
    until_s = time.monotonic() + seconds
    trips = await asyncio.gather(*(poll(port, 1 / hz, until_s, i / hz / clients) for i in range(clients)))
    print(json.dumps([round(ms, 4) for one in trips for ms in one]))


if __name__ == "__main__":
    port, clients, hz, seconds = sys.argv[1:]
    asyncio.run(main(int(port), int(clients), float(hz), float(seconds)))
