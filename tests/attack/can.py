"""Random CAN frames and random text for the CAN hub, and random objects for the CANopen node."""

from __future__ import annotations

import random
import socket
import struct
import time
from contextlib import suppress

from pneuforce.registers.can.frames import COMMAND, DEFAULT_NODE_ID, FRAMES
from pneuforce.registers.can.wire import CanFrame, FrameKind
from pneuforce.registers.canopen.lss import LSS_REQUEST_ID
from pneuforce.registers.canopen.object_dictionary import ENTRIES
from pneuforce.registers.modbus.client import ModbusClient
from tests.attack.result import AttackResult
from tests.attack.target import attacked
from tests.registers.canopen.fake_master import FakeMaster
from tests.system.waiting import wait_for

OPEN, RAW = b"< open can0 >", b"< rawmode >"
IDS = (0x000, 0x080, *(frame.base_id + DEFAULT_NODE_ID for frame in FRAMES), 0x605, 0x705, 0x7FF)
TEXTS = (
    b"< ",
    b" >",
    b"<>",
    b"< send 205 9 00 >",
    b"< send xyz 1 00 >",
    b"< echo >",
    b"< open >",
    b"POST / HTTP/1.1\r\n\r\n",
    b"\x00" * 300,
    b"<" * 300,
    b"\xff\xfe",
    b"< error >",
    b"< frame 205 0.0 00 >",
)
COMMAND_MODES = (0, 1, 2, 3, 4, 255)
PER_CONNECTION = 60  #: messages on one connection, fewer than the transmit queue holds
PACE_S = 0.004


def command_data(rng: random.Random) -> bytes:
    """Return a Command whose fields are often valid."""
    setpoint = rng.choice((0, 2000, 8000, 12000, 12001, 0xFFFF))
    lease = rng.choice((0, 200, 1000, 60000, 0xFFFF))
    return struct.pack(
        "<HBBHH", setpoint, rng.choice(COMMAND_MODES), rng.randrange(256), lease, rng.choice((0, 0, 1))
    )


def any_message(rng: random.Random) -> bytes:
    """Return one message for the hub: a Command, another frame, or text that is not valid."""
    kind = rng.random()
    if kind < 0.15:
        return rng.choice((*TEXTS, rng.randbytes(rng.randint(1, 64))))
    if kind < 0.6:
        identifier, data = COMMAND.base_id + DEFAULT_NODE_ID, command_data(rng)[: rng.choice((8, 8, 8, 3))]
    else:
        identifier, data = rng.choice((*IDS, rng.randrange(0x800))), rng.randbytes(rng.randint(0, 8))
    words = " ".join(f"{byte:02X}" for byte in data)
    return f"< send {identifier:03X} {len(data)} {words} >".encode()


def wait_until_joined(modbus_port: int) -> None:
    """Wait until the node has joined the bus. Before that, a frame with the id of the node ends the start."""
    with ModbusClient.connect(port=modbus_port) as client:
        wait_for(client.read, lambda values: "can_down" not in values["status"])


def attack_can(result: AttackResult, rng: random.Random, amount: int) -> None:
    """Send messages to the hub. The instrument must stay vented, because the PLC holds the lease."""
    with attacked(result) as stack:
        wait_until_joined(stack.modbus_port)
        while result.sent < amount:
            with socket.create_connection(("127.0.0.1", stack.can_port)) as client, suppress(OSError):
                result.notes["connections"] += 1
                client.settimeout(1.0)
                client.sendall(OPEN + RAW if rng.random() < 0.9 else rng.choice(TEXTS))
                for _ in range(PER_CONNECTION):
                    client.sendall(any_message(rng))
                    result.sent += 1
                    time.sleep(PACE_S * (result.sent % 10 == 0))
                client.setblocking(False)
                with suppress(BlockingIOError):
                    while client.recv(65536):
                        result.notes["pieces received"] += 1


def attack_canopen(result: AttackResult, rng: random.Random, amount: int) -> None:
    """Send random frames to a CANopen node in virtual time. Afterwards an upload must be answered."""
    master = FakeMaster()
    heads = (0x40, 0x20, 0x21, 0x22, 0x23, 0x27, 0x2B, 0x2F, 0x60, 0x70, 0x00, 0x10, 0x80, 0x07, 0x17)
    addresses = [entry.address for entry in ENTRIES]
    for _ in range(amount):
        if rng.random() < 0.1:
            head = bytes((rng.choice((4, 17, 19, 21, 23, rng.randrange(256))), rng.choice((0, 1, 7, 255))))
            frame = CanFrame(LSS_REQUEST_ID, head + rng.randbytes(6))
        elif rng.random() < 0.6:
            data = struct.pack("<BHB", rng.choice(heads), *rng.choice(addresses)) + rng.randbytes(4)
            frame = CanFrame(0x605, data)
        else:
            kind = rng.choice([FrameKind.DATA] * 6 + [FrameKind.REMOTE, FrameKind.EXTENDED, FrameKind.ERROR])
            frame = CanFrame(rng.choice(IDS), rng.randbytes(rng.randint(0, 8)), kind)
        answers = master.node.receive(frame, master.now_s)
        result.notes["answers"] += len(answers)
        result.sent += 1
        master.now_s += rng.choice((0.0, 0.001, 0.01))
        master.node.tick(master.now_s)
    master.node.receive(CanFrame(0x000, b"\x80\x05"), master.now_s)
    master.now_s += 20.0
    master.node.tick(master.now_s)
    answers = master.node.receive(CanFrame(0x605, bytes.fromhex("40 18 10 01 00 00 00 00")), master.now_s)
    result.check(any(frame.id == 0x585 for frame in answers), "an upload is no longer answered")
