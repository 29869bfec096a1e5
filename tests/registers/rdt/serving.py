"""RDT server on a real UDP socket, whose host loop is the test, and addresses for RDT servers."""

import secrets
import socket
from contextlib import contextmanager

from pneuforce.registers.rdt.options import RdtOptions
from pneuforce.registers.rdt.record import RdtCommand, decode_record, encode_request
from pneuforce.registers.rdt.server import RdtServer
from tests.registers.can.fake_source import FakeSource

SAMPLE_S = 0.002


def loopback_address():
    """Return a random loopback address, so that several tests can use the port of RDT at the same time."""
    return f"127.{1 + secrets.randbelow(254)}.{secrets.randbelow(256)}.{1 + secrets.randbelow(254)}"


class Loop:
    """Loop that gives a server samples and ticks, with a clock of its own.

    `stall_s` is the duration of a stall between the time that the server receives and the send of a record.
    """

    def __init__(self, source, **options):
        self.now_s, self.stall_s = 100.0, 0.0
        self.source = source
        self.server = RdtServer(source, RdtOptions(port=0, **options), lambda: self.now_s + self.stall_s)

    def samples(self, count=1):
        """Give the server new samples."""
        for _ in range(count):
            self.now_s += SAMPLE_S
            self.source.set(sample_counter=self.source.now.sample_counter + 1)
            self.server.on_sample(self.now_s)

    def tick(self, elapsed_s=0.01):
        """Let time pass without samples."""
        self.now_s += elapsed_s
        self.server.tick(self.now_s)


@contextmanager
def serving(**options):
    """Open a server on a free port. Yield its loop."""
    source = FakeSource(force_n=1.25, force_std_n=0.01)
    loop = Loop(source, **options)
    loop.server.open()
    try:
        yield loop
    finally:
        loop.server.close()


@contextmanager
def client_of(loop, address="127.0.0.1"):
    """Open a client socket at `address` that is connected to the server."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
        client.bind((address, 0))
        client.connect(("127.0.0.1", loop.server.port))
        client.setblocking(False)
        yield client


def start(client, count=0, command=RdtCommand.START_REALTIME):
    """Send a start request."""
    client.send(encode_request(command, count))


def received(client):
    """Return all records that have arrived."""
    records = []
    while True:
        try:
            records.append(decode_record(client.recv(1024)))
        except BlockingIOError:
            return records
