"""Random datagrams from several loopback addresses for an RDT server whose host loop is the attack."""

from __future__ import annotations

import random
import socket
import struct
from contextlib import suppress

from pneuforce.registers.rdt.record import RdtCommand, decode_record
from pneuforce.registers.rdt.streams import MAX_STREAMS
from tests.attack.modbus import mutated
from tests.attack.result import AttackResult
from tests.registers.rdt.serving import Loop, client_of, received, serving, start

ALLOWED = tuple(f"127.0.0.{number}" for number in range(2, 6))
NOT_ALLOWED = ("127.0.0.6", "127.0.0.7")
STARTS = (RdtCommand.START_REALTIME,) * 6
COMMANDS = (*STARTS, *RdtCommand, 5, 0x40, 0x43, 0x0200, 0xFFFF)
COUNTS = (0, 0, 1, 2, 500, 0x7FFFFFFF, 0xFFFFFFFF)
PER_SAMPLE = 4  #: datagrams between two samples
MAX_SOCKETS = 12


def any_datagram(rng: random.Random) -> bytes:
    """Return a datagram that is often a valid request."""
    if rng.random() < 0.1:
        return rng.randbytes(rng.choice((0, 1, 7, 8, 9, 36, 1400, 60_000)))
    request = struct.pack(">HHI", 0x1234, rng.choice(COMMANDS), rng.choice(COUNTS))
    return mutated(request, rng) if rng.random() < 0.5 else request


def attack_rdt(result: AttackResult, rng: random.Random, amount: int) -> None:
    """Send datagrams. A client must receive a record for each sample, and nothing may be written."""
    with serving(host="0.0.0.0", allow=ALLOWED) as loop, client_of(loop) as client:
        start(client)
        crowd: list[socket.socket] = []
        while result.sent < amount:
            if len(crowd) < MAX_SOCKETS:
                crowd.append(_connection(rng.choice(ALLOWED + NOT_ALLOWED), loop.server.port))
            with suppress(OSError):  # an ICMP message of an earlier datagram
                rng.choice(crowd).send(any_datagram(rng))
            result.sent += 1
            if result.sent % PER_SAMPLE == 0:
                _check_sample(loop, client, result)
            if rng.random() < 0.01:
                _close(crowd.pop(rng.randrange(len(crowd))), result)
        for attacker in crowd:
            _close(attacker, result)
        result.notes["refused"] = loop.server.counters.refused
        result.check(not loop.source.written, "a request wrote a value")
        result.check(not loop.source.rejected_writes, "a request was handled as a write")
        _check_recovery(loop, result)


def _connection(address: str, port: int) -> socket.socket:
    attacker = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    attacker.bind((address, 0))
    attacker.connect(("127.0.0.1", port))
    attacker.setblocking(False)
    return attacker


def _check_sample(loop: Loop, client: socket.socket, result: AttackResult) -> None:
    loop.samples()
    records = received(client)
    numbers = [record.ft_sequence for record in records]
    result.check(numbers == [loop.source.now.sample_counter], f"the client received the samples {numbers}")
    result.check(all(record.force_n == 1.25 for record in records), "the force changed")
    result.check(len(loop.server.streams) <= MAX_STREAMS, "there are too many streams")
    result.notes["records of the client"] += len(records)


def _close(attacker: socket.socket, result: AttackResult) -> None:
    """Close a socket. Each answer must be a record, and only allowed addresses may receive records."""
    allowed = attacker.getsockname()[0] in ALLOWED
    with suppress(OSError):
        while True:
            answer = attacker.recv(2048)
            result.notes["records of attackers"] += 1
            result.check(allowed, "an address that is not allowed received an answer")
            result.check(decode_record(answer).is_valid, "an answer is not a valid record")
    attacker.close()


def _check_recovery(loop: Loop, result: AttackResult) -> None:
    """Check that the places of closed sockets are free again."""
    loop.samples(2)
    with client_of(loop) as late:
        start(late)
        loop.samples(3)
        result.check(len(received(late)) == 3, "after the attack, a new client is not served")
