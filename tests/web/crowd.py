"""Crowd of clients that load a web server: `python -m tests.web.crowd PORT BEHAVIOUR COUNT ADDRESS…`.

Each client opens a connection, behaves as a function in `BEHAVIOURS` describes, and begins again. The clients
use the given behaviours and addresses of this machine in turn. The process prints one line when all clients
have started.
"""

import asyncio
import contextlib
import functools
import itertools
import ssl
import sys

DRIP_PERIOD_S = 0.2
REQUEST_PERIOD_S = 0.5


async def be_silent(reader, writer):
    """Send nothing until the web server closes the connection."""
    await reader.read(1)


async def close_at_once(reader, writer):
    """Close the connection without a request."""


async def send_half_a_head(reader, writer):
    """Send the first part of a request head."""
    writer.write(b"POST /api/vent HTTP/1.1\r\nHost: local")
    await reader.read(1)


async def drip_a_head(reader, writer):
    """Send an endless request head, one header after the other."""
    writer.write(b"POST /api/vent HTTP/1.1\r\nHost: localhost\r\n")
    while not reader.at_eof():
        writer.write(b"X: 1\r\n")
        await asyncio.sleep(DRIP_PERIOD_S)
        await writer.drain()


async def send_half_a_body(reader, writer):
    """Send a request for which a part of the body is missing."""
    writer.write(b"POST /api/login HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9\r\n\r\n{")
    while await reader.read(1000):
        pass


async def request_in_a_loop(reader, writer):
    """Send complete requests, one after the other."""
    while True:
        writer.write(b"GET /api/frames HTTP/1.1\r\nHost: localhost\r\n\r\n")
        await reader.readuntil(b"}")


async def request_now_and_then(reader, writer):
    """Send a complete request twice per second, so that the connection is idle most of the time."""
    while True:
        writer.write(b"GET /api/frames HTTP/1.1\r\nHost: localhost\r\n\r\n")
        await reader.readuntil(b"}")
        await asyncio.sleep(REQUEST_PERIOD_S)


async def vent_in_a_loop(reader, writer):
    """Send vent requests, one after the other."""
    while True:
        writer.write(b"POST /api/vent HTTP/1.1\r\nHost: localhost\r\n\r\n")
        await reader.readuntil(b"}")


async def read_no_answer(reader, writer):
    """Request a large file and do not read the answer."""
    writer.transport.pause_reading()
    writer.write(b"GET /static/vendor/uPlot.esm.js HTTP/1.1\r\nHost: localhost\r\n\r\n" * 20)
    await asyncio.sleep(REQUEST_PERIOD_S)


async def follow_the_stream(reader, writer):
    """Open an event stream and read it."""
    writer.write(b"GET /api/live HTTP/1.1\r\nHost: localhost\r\n\r\n")
    while await reader.read(100_000):
        pass


async def begin_a_handshake(reader, writer):
    """Send the first bytes of a TLS handshake."""
    writer.write(client_hello()[:20])
    await reader.read(1)


async def demand_a_handshake(reader, writer):
    """Make the server compute its part of a TLS handshake, then begin again."""
    writer.write(client_hello())
    await reader.read(1)


@functools.cache
def client_hello():
    """Return the first message of a TLS handshake."""
    outgoing = ssl.MemoryBIO()
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    with contextlib.suppress(ssl.SSLWantReadError):
        context.wrap_bio(ssl.MemoryBIO(), outgoing, server_hostname="localhost").do_handshake()
    return outgoing.read()


BEHAVIOURS = {
    behaviour.__name__: behaviour
    for behaviour in (
        be_silent,
        close_at_once,
        send_half_a_head,
        drip_a_head,
        send_half_a_body,
        request_in_a_loop,
        request_now_and_then,
        vent_in_a_loop,
        read_no_answer,
        follow_the_stream,
        begin_a_handshake,
        demand_a_handshake,
    )
}


async def repeat(behaviour, port, address):
    """Open connections one after the other."""
    while True:
        try:
            reader, writer = await asyncio.open_connection("127.0.0.1", port, local_addr=(address, 0))
        except OSError:
            await asyncio.sleep(0.01)
            continue
        try:
            await behaviour(reader, writer)
        except (OSError, asyncio.IncompleteReadError):
            await asyncio.sleep(0.001)
        finally:
            writer.transport.abort()


async def run(port, names, count, addresses):
    """Start all clients and print one line."""
    behaviours = itertools.cycle([BEHAVIOURS[name] for name in names])
    pairs = zip(range(count), behaviours, itertools.cycle(addresses), strict=False)
    tasks = [asyncio.create_task(repeat(behaviour, port, address)) for _, behaviour, address in pairs]
    await asyncio.sleep(1.0)
    print("started", flush=True)
    await asyncio.gather(*tasks)


if __name__ == "__main__":
    asyncio.run(run(int(sys.argv[1]), sys.argv[2].split(","), int(sys.argv[3]), sys.argv[4:]))
