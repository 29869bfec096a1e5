"""Mutated Modbus requests over TCP from several loopback addresses, and over a virtual serial line."""

from __future__ import annotations

import random
import socket
import struct
from contextlib import suppress

from pneuforce.registers.map import BLOCKS, REGISTERS
from pneuforce.registers.modbus.rtu import encode_frame as rtu_frame
from tests.attack.result import AttackResult
from tests.attack.target import attacked
from tests.registers.modbus.rtu_lines import SILENCE_S, VirtualLine

ADDRESSES = tuple(f"127.0.0.{number}" for number in range(2, 8))
FUNCTIONS = (1, 2, 3, 4, 5, 6, 8, 15, 16, 22, 23, 43, 7, 20, 24, 90, 127, 128, 255)
EDGES = (0, 1, 2, 123, 124, 125, 126, 127, 0x7FFF, 0x8000, 0xFFFE, 0xFFFF)
ANSWER_TIMEOUT_S = 0.25
ANSWER_EVERY = 8  #: the answers are awaited after this number of requests
EXCEPTIONS = frozenset((1, 2, 3, 4, 6, 11))


def any_address(rng: random.Random) -> int:
    """Return an address near a register, at the end of a block, or anywhere."""
    near = rng.choice([*(r.address for r in REGISTERS), *(end for block in BLOCKS for end in block)])
    return rng.choice([near, near, near + rng.randint(-2, 2), rng.choice(EDGES)]) & 0xFFFF


def any_request(rng: random.Random) -> bytes:
    """Return a request that is often valid."""
    function, address, count = rng.choice(FUNCTIONS), any_address(rng), rng.choice([1, 2, 2, 20, 125])
    if function in (15, 16):
        words = rng.randbytes(2 * min(count, 123))
        return struct.pack(">BHHB", function, address, len(words) // 2, len(words)) + words
    if function == 23:
        words = rng.randbytes(2 * min(count, 121))
        head = (function, any_address(rng), count, address, len(words) // 2, len(words))
        return struct.pack(">BHHHHB", *head) + words
    if function == 22:
        return struct.pack(">BHHH", function, address, *(rng.choice(EDGES) for _ in range(2)))
    if function == 43:
        return bytes((function, rng.choice((14, 13)), rng.randint(0, 5), rng.randint(0, 255)))
    return struct.pack(">BHH", function, address, rng.choice([count, rng.choice(EDGES)]))


def mutated(data: bytes, rng: random.Random) -> bytes:
    """Return `data` with some changed, missing or additional bytes. One of four stays as it is."""
    changed = bytearray(data)
    for _ in range(rng.choice((0, 1, 1, 3))):
        at = rng.randrange(len(changed) + 1)
        match rng.randrange(4):
            case 0 if at < len(changed):
                changed[at] ^= 1 << rng.randrange(8)
            case 1:
                del changed[at:]
            case 2:
                changed[at:at] = rng.randbytes(rng.choice((1, 2, 9, 300)))
            case _ if at < len(changed):
                changed[at] = rng.choice((0, 1, 0x7F, 0x80, 0xFF))
        if not changed:
            break
    return bytes(changed)


def adu(rng: random.Random) -> bytes:
    """Return one mutated TCP frame."""
    pdu = mutated(any_request(rng), rng)
    head = struct.pack(">HHHB", rng.randrange(65536), 0, len(pdu) + 1, rng.choice((1, 1, 1, 0, 255, 7)))
    return mutated(head + pdu, rng) if rng.random() < 0.3 else head + pdu


def attack_modbus(result: AttackResult, rng: random.Random, amount: int) -> None:
    """Send mutated frames over TCP. Each answer must be well formed, and other clients must not notice."""
    with attacked(result) as stack:
        clients: dict[str, socket.socket] = {}
        while result.sent < amount:
            address = rng.choice(ADDRESSES)
            if address not in clients:
                clients[address] = _connection(address, stack.modbus_port)
                result.notes["connections"] += 1
            with suppress(OSError):
                clients[address].sendall(b"".join(adu(rng) for _ in range(ANSWER_EVERY)))
            result.sent += ANSWER_EVERY
            if not _check_answers(clients[address], result):
                clients.pop(address).close()
        for client in clients.values():
            client.close()


def _connection(address: str, port: int) -> socket.socket:
    client = socket.socket()
    client.bind((address, 0))
    client.settimeout(ANSWER_TIMEOUT_S)
    client.connect(("127.0.0.1", port))
    return client


def _check_answers(client: socket.socket, result: AttackResult) -> bool:
    """Check the answers that arrive. Return True if the connection is still open."""
    received = b""
    while True:
        try:
            piece = client.recv(65536)
        except TimeoutError:
            break
        except OSError:
            piece = b""
        if not piece:
            _check_frames(received, result)
            result.notes["connections closed by the server"] += 1
            return False
        received += piece
        if len(received) >= 9 * ANSWER_EVERY:
            client.settimeout(0.002)
    client.settimeout(ANSWER_TIMEOUT_S)
    _check_frames(received, result)
    return False  # an incomplete frame may be pending in the server


def _check_frames(received: bytes, result: AttackResult) -> None:
    while len(received) >= 9:
        _, protocol, length, _ = struct.unpack_from(">HHHB", received)
        pdu, received = received[7 : 6 + length], received[6 + length :]
        well_formed = protocol == 0 and 3 <= length <= 254 and len(pdu) == length - 1
        result.check(well_formed, f"malformed answer {pdu.hex(' ')}")
        if not well_formed:
            return
        if pdu[0] & 0x80:
            result.check(len(pdu) == 2 and pdu[1] in EXCEPTIONS, f"odd exception {pdu.hex(' ')}")
        result.notes["exceptions" if pdu[0] & 0x80 else "answers"] += 1
    result.check(not received, f"an incomplete answer of {len(received)} bytes")


def attack_rtu(result: AttackResult, rng: random.Random, amount: int) -> None:
    """Play mutated frames and pauses on a virtual serial line. Afterwards a read must be answered."""
    line = VirtualLine()
    while result.sent < amount:
        pieces: list[bytes | float] = []
        for _ in range(rng.randint(1, 4)):
            frame = rtu_frame(rng.choice((1, 1, 0, 2, 248)), mutated(any_request(rng), rng) or b"\x03")
            pieces.append(mutated(frame, rng) if rng.random() < 0.4 else frame)
            pieces.append(rng.choice((0.0, 0.4, 0.8, 1.0, 3.0)) * SILENCE_S)
            result.sent += 1
        for answer in line.play(*pieces):
            result.check(
                rtu_frame(answer[0], answer[1:-2]) == answer, f"answer with a wrong CRC: {answer.hex(' ')}"
            )
            result.notes["answers"] += 1
    result.check(bool(line.send_request("04 0000 0002")), "a read is no longer answered")
