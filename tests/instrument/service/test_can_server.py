"""The CAN face between a real instrument and a virtual bus, on which somebody else's client plays."""

import asyncio
import logging
import time
from contextlib import asynccontextmanager
from itertools import count

import can
import pytest

from instrument.cli.can_face import CanFace
from instrument.config import Configuration
from instrument.core import Instrument, Settings
from registers.can.frames import ANSWER, COMMAND, decode, encode, sent_ids
from registers.can.inbox import MOST_FRAMES
from registers.sparing_log import MOST_LINES
from tests.registers.can.conftest import wait_for

_channels = count()


@asynccontextmanager
async def joined(**own):
    """A face on a bus of its own, its instrument, and a client beside it."""
    at = {"interface": "virtual", "channel": f"face-{next(_channels)}"}
    instrument = Instrument(Settings())
    own = Configuration.model_validate({"can": at | {"enabled": True} | own}).can
    face = CanFace(instrument, own)
    with can.Bus(**at) as peer:
        await face.open(asyncio.Event())
        try:
            yield face, instrument, peer
        finally:
            face.close()


async def until(face, condition, deadline_s=15.0):
    """Tick until it has come about."""
    until_s = time.monotonic() + deadline_s
    while not condition():
        assert time.monotonic() < until_s, "it did not come about in time"
        face.tick(time.monotonic())
        await asyncio.sleep(0.01)


def data_frame(can_id, data):
    return can.Message(arbitration_id=can_id, data=data, is_extended_id=False)


HOLD = {"setpoint": 8.0, "mode": "hold", "sequence": 1, "lease": 0.0, "reserved": 0}
VENT = HOLD | {"mode": "vent", "sequence": 99}


def command(**changes):
    return data_frame(0x205, encode(COMMAND, None, **(HOLD | changes)))


def bus_off():
    """As SocketCAN reports it, and python-can hands it on."""
    return can.Message(is_error_frame=True, arbitration_id=0x40, is_extended_id=False, data=bytes(8))


def test_a_bus_that_goes_off_is_told_on_the_other_buses_and_joined_again(caplog):
    async def play():
        async with joined() as (face, instrument, peer):
            face.tick(time.monotonic())
            assert not instrument.can_down
            peer.send(bus_off())
            await until(face, lambda: instrument.can_down)
            assert "can_down" in instrument.snapshot(("modbus_tcp", ""), time.monotonic()).status
            await until(face, lambda: not instrument.can_down)

    asyncio.run(play())
    assert "CAN is down: virtual face-" in caplog.text
    assert "the controller is bus-off" in caplog.text
    assert "CAN is up again" in caplog.text


@pytest.mark.parametrize("mode", ["raw", "canopen"])
def test_another_node_that_comes_later_with_our_id_is_told_and_obeyed_in_nothing(caplog, mode):
    async def play():
        async with joined(mode=mode) as (face, instrument, peer):
            for sent in sent_ids(5):
                peer.send(data_frame(sent, b"\x05"))
            wait_for(lambda: face.bus.counters.received == 7)
            await asyncio.sleep(0)
            await until(face, lambda: "another node" in caplog.text)
            assert not instrument.can_down

    with caplog.at_level(logging.WARNING):
        asyncio.run(play())
    assert "frames of another node with our id 5 7" in caplog.text


def test_a_vent_behind_a_flood_is_carried_out(caplog):
    async def play():
        async with joined() as (face, _, peer):
            answers = []
            for sequence in range(1, 200):
                peer.send(command(sequence=sequence))
            peer.send(command(mode="vent", sequence=200))
            wait_for(lambda: face.bus.counters.received == 200)  # while the loop stands
            await until(face, lambda: answers_of(peer, answers)[-1:] == [(200, "accepted")])
            assert len(answers) <= MOST_FRAMES

    asyncio.run(play())
    assert "frames cut from a flood" in caplog.text


def test_a_vent_by_sdo_behind_a_flood_is_carried_out():
    async def play():
        async with joined(mode="canopen") as (face, _, peer):
            face.tick(time.monotonic())  # boot-up
            for _ in range(199):
                peer.send(data_frame(0x605, bytes.fromhex("4000100000000000")))
            peer.send(data_frame(0x605, bytes.fromhex("2B04220000000000")))
            wait_for(lambda: face.bus.counters.received == 200)  # while the loop stands
            answers = []
            await until(face, lambda: sdo_answers_of(peer, answers)[-1:] == ["6004220000000000"])
            assert len(answers) == MOST_FRAMES

    asyncio.run(play())


def sdo_answers_of(peer, answers):
    while (message := peer.recv(0)) is not None:
        if message.arbitration_id == 0x585:
            answers.append(message.data.hex())
    return answers


def answers_of(peer, answers):
    while (message := peer.recv(0)) is not None:
        if message.arbitration_id == 0x485:
            values = decode(ANSWER, bytes(message.data))
            answers.append((values["sequence"], values["result"]))
    return answers


def test_a_frame_that_we_fail_on_is_told_and_the_next_one_is_obeyed(caplog):
    async def play():
        async with joined() as (face, instrument, peer):
            write = instrument.write
            instrument.write = lambda *request: 1 / 0
            for sequence in range(1, 11):
                peer.send(command(sequence=sequence))
            await until(face, lambda: "errors of ours" in caplog.text)
            instrument.write = write
            peer.send(command(mode="vent", sequence=20))
            answers = []
            await until(face, lambda: answers_of(peer, answers)[-1:] == [(20, "accepted")])
            assert face._errors == 10

    asyncio.run(play())
    assert "CAN frame 205h dropped after an error of ours" in caplog.text
    assert caplog.text.count("ZeroDivisionError") == MOST_LINES
    assert "Exception in callback" not in caplog.text


def test_a_frame_with_29_bits_is_neither_a_namesake_nor_a_vent_that_takes_anothers_place(caplog):
    async def play():
        async with joined() as (face, _, peer):
            answers = []
            for sequence in range(1, MOST_FRAMES + 1):
                peer.send(command(sequence=sequence))
            for can_id, data in ((0x205, encode(COMMAND, None, **VENT)), (0x705, b"\x05")):
                peer.send(can.Message(arbitration_id=can_id, data=data, is_extended_id=True))
            wait_for(lambda: face.bus.counters.received == MOST_FRAMES + 2)  # while the loop stands
            await until(face, lambda: len(answers_of(peer, answers)) == MOST_FRAMES)
            assert answers[-1][0] == MOST_FRAMES
            peer.send(can.Message(arbitration_id=0x705, data=b"\x05", is_extended_id=True))
            await until(face, lambda: face.node.counters.ignored)
            assert face._namesakes == 0

    asyncio.run(play())
