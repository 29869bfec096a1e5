"""Tests of the CAN server between a real instrument and a virtual bus with a second python-can client."""

import asyncio
import logging
import time
from contextlib import asynccontextmanager
from itertools import count

import can
import pytest

from pneuforce.instrument.config import Configuration
from pneuforce.instrument.core.controller import Instrument
from pneuforce.instrument.core.settings import Settings
from pneuforce.instrument.service.buses.can_server import CanServer
from pneuforce.registers.can.frames import ANSWER, COMMAND, decode, encode, transmit_ids
from pneuforce.registers.can.receive_queue import MAX_FRAMES
from pneuforce.registers.canopen import stored_parameters
from pneuforce.registers.canopen.stored_parameters import StoredParameters
from pneuforce.support.throttle import MAX_LINES
from tests.registers.can.conftest import wait_for

_channels = count()


@asynccontextmanager
async def joined(**settings):
    """Run a server on a separate virtual bus. Yield the server, its instrument and a second client."""
    at = {"interface": "virtual", "channel": f"server-{next(_channels)}"}
    instrument = Instrument(Settings())
    section = Configuration.model_validate({"can": at | {"enabled": True} | settings}).can
    server = CanServer(instrument, section)
    with can.Bus(**at) as peer:
        await server.open(asyncio.Event())
        try:
            yield server, instrument, peer
        finally:
            server.close()


async def until(server, condition, deadline_s=15.0):
    """Call `server.tick` until the condition is true."""
    until_s = time.monotonic() + deadline_s
    while not condition():
        assert time.monotonic() < until_s, "the condition was not true in time"
        server.tick(time.monotonic())
        await asyncio.sleep(0.01)


def data_frame(can_id, data):
    return can.Message(arbitration_id=can_id, data=data, is_extended_id=False)


HOLD = {"setpoint": 8.0, "mode": "hold", "sequence": 1, "lease": 0.0, "proof_test": "allowed"}
VENT = HOLD | {"mode": "vent", "sequence": 99}


def command(**changes):
    return data_frame(0x205, encode(COMMAND, None, **(HOLD | changes)))


def bus_off():
    """Return the frame with which python-can reports bus-off on SocketCAN."""
    return can.Message(is_error_frame=True, arbitration_id=0x40, is_extended_id=False, data=bytes(8))


def test_bus_off_is_visible_on_the_other_buses_and_ends(caplog):
    async def run():
        async with joined() as (server, instrument, peer):
            server.tick(time.monotonic())
            assert not instrument.can_down
            peer.send(bus_off())
            await until(server, lambda: instrument.can_down)
            assert "can_down" in instrument.snapshot(("modbus_tcp", ""), time.monotonic()).status
            await until(server, lambda: not instrument.can_down)

    asyncio.run(run())
    assert "CAN is down: virtual server-" in caplog.text
    assert "the controller is bus-off" in caplog.text
    assert "CAN is up again" in caplog.text


@pytest.mark.parametrize("mode", ["raw", "canopen"])
def test_another_node_with_our_id_is_logged_and_its_frames_ignored(caplog, mode):
    async def run():
        async with joined(mode=mode) as (server, instrument, peer):
            for sent in transmit_ids(5):
                peer.send(data_frame(sent, b"\x05"))
            wait_for(lambda: server.bus.counters.received == len(transmit_ids(5)))
            await asyncio.sleep(0)
            await until(server, lambda: "another node" in caplog.text)
            assert not instrument.can_down

    with caplog.at_level(logging.WARNING):
        asyncio.run(run())
    assert "frames of another node with our id 5 8" in caplog.text


def test_a_vent_after_a_flood_is_executed(caplog):
    async def run():
        async with joined() as (server, _, peer):
            answers = []
            for sequence in range(1, 200):
                peer.send(command(sequence=sequence))
            peer.send(command(mode="vent", sequence=200))
            wait_for(lambda: server.bus.counters.received == 200)  # while the loop is blocked
            await until(server, lambda: answers_of(peer, answers)[-1:] == [(200, "accepted")])
            assert len(answers) <= MAX_FRAMES

    asyncio.run(run())
    assert "frames dropped because of a flood" in caplog.text


def test_a_vent_by_sdo_after_a_flood_is_executed():
    async def run():
        async with joined(mode="canopen") as (server, _, peer):
            server.tick(time.monotonic())  # sends the boot-up message
            for _ in range(199):
                peer.send(data_frame(0x605, bytes.fromhex("4000100000000000")))
            peer.send(data_frame(0x605, bytes.fromhex("2B04220000000000")))
            wait_for(lambda: server.bus.counters.received == 200)  # while the loop is blocked
            answers = []
            await until(server, lambda: sdo_answers_of(peer, answers)[-1:] == ["6004220000000000"])
            assert len(answers) == MAX_FRAMES

    asyncio.run(run())


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


def test_a_frame_that_causes_an_internal_error_is_logged_and_the_next_one_executed(caplog):
    async def run():
        async with joined() as (server, instrument, peer):
            write = instrument.write
            instrument.write = lambda *request: 1 / 0
            for sequence in range(1, 11):
                peer.send(command(sequence=sequence))
            await until(server, lambda: "internal errors" in caplog.text)
            instrument.write = write
            peer.send(command(mode="vent", sequence=20))
            answers = []
            await until(server, lambda: answers_of(peer, answers)[-1:] == [(20, "accepted")])
            assert server._errors == 10

    asyncio.run(run())
    assert "CAN frame 205h dropped" in caplog.text
    assert caplog.text.count("ZeroDivisionError") == MAX_LINES
    assert "Exception in callback" not in caplog.text


def test_a_frame_with_29_bits_is_neither_a_duplicate_id_nor_a_vent_with_priority(caplog):
    async def run():
        async with joined() as (server, _, peer):
            answers = []
            for sequence in range(1, MAX_FRAMES + 1):
                peer.send(command(sequence=sequence))
            for can_id, data in ((0x205, encode(COMMAND, None, **VENT)), (0x705, b"\x05")):
                peer.send(can.Message(arbitration_id=can_id, data=data, is_extended_id=True))
            wait_for(lambda: server.bus.counters.received == MAX_FRAMES + 2)  # while the loop is blocked
            await until(server, lambda: len(answers_of(peer, answers)) == MAX_FRAMES)
            assert answers[-1][0] == MAX_FRAMES
            peer.send(can.Message(arbitration_id=0x705, data=b"\x05", is_extended_id=True))
            await until(server, lambda: server.node.counters.ignored)
            assert server._duplicate_id_frames == 0

    asyncio.run(run())


def test_a_stored_node_id_that_is_in_use_does_not_prevent_the_start(caplog, tmp_path):
    file = tmp_path / "canopen.json"
    file.write_bytes(stored_parameters.encode(StoredParameters(7), configured_node_id=5))

    async def run():
        stop = asyncio.Event()
        at = {"interface": "virtual", "channel": f"server-{next(_channels)}"}
        section = Configuration.model_validate({"can": at | {"enabled": True, "mode": "canopen"}}).can
        server = CanServer(Instrument(Settings()), section, file)
        assert server.node.options.node_id == 7
        with can.Bus(**at) as peer:
            heartbeats = peer.send_periodic(data_frame(0x707, b"\x05"), 0.2)
            try:
                await server.open(stop)
            finally:
                heartbeats.stop()
                server.close()
        assert server.node.options.node_id == 5
        assert server.node.storage.summary == "not used: another node has the node id 7"

    asyncio.run(run())
    assert "stored CANopen node id is not used: CAN node id 7 is already in use" in caplog.text
