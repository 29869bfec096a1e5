"""Tests of 1010h and 1011h: parameters are stored in a file, and a bad file never prevents a start."""

import json
import os
import time
import zlib
from concurrent.futures import Future
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneuforce.instrument.service.buses.parameter_file import storage_of
from pneuforce.registers.canopen.parameter_storage import ParameterStorage
from pneuforce.registers.canopen.stored_parameters import StoredParameters, decode, encode
from tests.registers.canopen.fake_master import FakeMaster, format_frames, frames_match

SAVE, LOAD = "73 61 76 65", "6C 6F 61 64"
NODE_ID = 5
HEARTBEAT_500_MS = "605 2B 17 10 00 F4 01"
TIMEOUT_S = 600.0


@pytest.fixture
def file(tmp_path):
    return tmp_path / "canopen.json"


def start(file, **options):
    """Start a node with a file, as at a start of the instrument."""
    return FakeMaster(storage=storage_of(file, options.get("node_id", NODE_ID)), **options)


def store(master, index, sub, signature):
    """Write a signature, and return the response after the file is written."""
    frames = master.send(f"605 23 {index & 0xFF:02X} {index >> 8:02X} {sub:02X} {signature}")
    return format_frames(frames or [wait_for_response(master, 0x585)])


def wait_for_response(master, can_id):
    """Return the frame that the node sends when the file is written."""
    until_s = time.monotonic() + TIMEOUT_S
    while time.monotonic() < until_s:
        for frame in master.node.tick(master.now_s):
            if frame.id == can_id:
                return frame
        time.sleep(0.001)
    raise AssertionError("the file was not written in time")


def heartbeat_ms(master):
    return int.from_bytes(master.send("605 40 17 10 00")[0].data[4:6], "little")


@pytest.mark.parametrize("sub", [1, 2])
def test_stored_parameters_survive_a_reset_and_a_restart_until_they_are_restored(file, sub):
    master = start(file)
    master.send(HEARTBEAT_500_MS)
    assert store(master, 0x1010, sub, SAVE) == f"585 60 10 10 {sub:02X} 00 00 00 00"
    master.send("605 2B 17 10 00 64 00")
    master.send("000 82 05")
    assert heartbeat_ms(master) == 500
    master = start(file)
    assert heartbeat_ms(master) == 500
    assert store(master, 0x1011, sub, LOAD) == f"585 60 11 10 {sub:02X} 00 00 00 00"
    assert heartbeat_ms(master) == 500  # valid after the next reset
    master.send("000 81 05")
    assert heartbeat_ms(master) == 1000
    assert heartbeat_ms(start(file)) == 1000


def test_without_a_save_a_reset_restores_the_defaults_and_no_file_is_written(file):
    master = start(file)
    master.send(HEARTBEAT_500_MS)
    master.send("000 82 05")
    assert heartbeat_ms(master) == 1000
    assert not file.exists()


def test_every_parameter_is_stored_and_cob_ids_follow_the_node_id(file):
    master = start(file)
    for step in (
        "605 23 01 18 01 85 02 00 C0",  # TPDO 2 disabled
        "605 2B 01 18 03 32",
        "605 2F 01 18 02 05",
        "605 2B 01 18 05 C8",
        "605 23 16 10 01 F4 01 7F",
        "605 2B 15 10 00 64",
        "605 2F 29 10 01 02",
    ):
        assert master.send(step)[0].data[0] == 0x60
    store(master, 0x1010, 1, SAVE)
    stored = storage_of(file, NODE_ID).stored
    file.write_bytes(encode(stored, 9))
    master = start(file, node_id=9)
    values = master.node._parameters
    assert [values[0x1801, sub] for sub in (1, 2, 3, 5)] == [0xC000_0289, 5, 50, 200]
    assert [values[0x1016, 1], values[0x1015, 0], values[0x1029, 1]] == [0x7F_01F4, 100, 2]


def test_a_stored_master_is_monitored_from_its_first_heartbeat_after_a_restart(file):
    master = start(file)
    master.send("605 23 16 10 01 F4 01 7F")
    store(master, 0x1010, 1, SAVE)
    master = start(file)
    master.wait(2.0)
    assert master.source.masters_lost_s == []
    master.send("77F 05")
    master.wait(0.6)
    assert len(master.source.masters_lost_s) == 1


def test_a_monitoring_that_survived_a_reset_ends_with_the_first_heartbeat_of_the_stored_master(file):
    master = start(file)
    master.send("605 23 16 10 01 F4 01 7F")
    store(master, 0x1010, 1, SAVE)
    for step in ("605 23 16 10 01 F4 01 7E", "77E 05", "000 82 05"):
        master.send(step)
    master.wait(0.4)
    master.send("77F 05")
    master.wait(0.4)
    assert master.source.masters_lost_s == []
    master.wait(0.2)
    assert len(master.source.masters_lost_s) == 1


@pytest.mark.parametrize("index", [0x1010, 0x1011])
@pytest.mark.parametrize("signature", ["00", "65 76 61 73", "77 72 6F 6E", "53 41 56 45"])
def test_a_wrong_signature_is_aborted(file, index, signature):
    master = start(file)
    low = f"{index & 0xFF:02X}"
    assert store(master, index, 1, signature) == f"585 80 {low} 10 01 20 00 00 08"
    assert not file.exists()


@pytest.mark.parametrize(("index", "signature"), [(0x1010, SAVE), (0x1011, LOAD)])
def test_without_a_file_nothing_can_be_stored_and_the_objects_say_so(file, index, signature):
    low = f"{index & 0xFF:02X}"
    assert frames_match(f"585 43 {low} 10 01 01", start(file).send(f"605 40 {low} 10 01"))
    master = FakeMaster()
    assert frames_match(f"585 43 {low} 10 01", master.send(f"605 40 {low} 10 01"))
    assert store(master, index, 1, signature) == f"585 80 {low} 10 01 20 00 00 08"


def test_a_file_that_cannot_be_written_is_aborted_and_changes_nothing(file, caplog):
    master = start(file / "no folder" / "canopen.json")
    master.send(HEARTBEAT_500_MS)
    assert store(master, 0x1010, 1, SAVE) == "585 80 10 10 01 00 00 06 06"
    master.send("000 82 05")
    assert heartbeat_ms(master) == 1000
    assert "CANopen parameters not stored" in caplog.text


def test_a_slow_disk_blocks_neither_the_node_nor_a_vent():
    slow = Future()
    master = FakeMaster(storage=ParameterStorage(NODE_ID, None, lambda content: slow))
    save = f"605 23 10 10 01 {SAVE}"
    assert master.send(save) == []
    assert frames_match("585 80 10 10 01 22 00 00 08", master.send(save))  # the first write is not finished
    assert frames_match("585 60 04 22 00", master.send("605 2B 04 22 00 00"))
    assert master.source.written == [{"mode": "vent"}]
    slow.set_result(None)
    assert [f.id for _, f in master.wait(0.5) if f.id == 0x585] == []  # later requests cancelled the response
    assert master.node.storage.stored.values


DAMAGED = [
    b"",
    b"{",
    b"[]",
    b"null",
    b"\xff\xfe",
    b"9" * 5000,
    b"[" * 100_000,
    b'{"crc32": 0}',
]


def resealed(**changes):
    """Return the content of a file with other values and the right checksum."""
    good = json.loads(encode(StoredParameters(0, {(0x1017, 0): 500}), NODE_ID))
    del good["crc32"]
    changed = good | changes
    checksum = zlib.crc32(json.dumps(changed, sort_keys=True).encode())
    return json.dumps(changed | {"crc32": checksum}).encode()


REFUSED = [
    resealed(format=2),
    resealed(node_id=128),
    resealed(node_id=True),
    resealed(node_id="7"),
    resealed(configured_node_id=6),
    resealed(objects=[]),
    resealed(objects={"x": 1}),
    resealed(objects={"1017:0": 1.5}),
    resealed(objects={"1017:0": -1}),
    resealed(objects={"1017:0": 65536}),
    resealed(objects={"1017:0": 1}),  # too high a bus load at 125 kbit/s
    resealed(objects={"1029:1": 3}),
    resealed(objects={"1000:0": 1}),
    resealed(objects={"2204:0": 1}),
    resealed(objects={"1016:1": 0x0005_01F4}),  # this node itself
    resealed(objects={"1800:1": 0x4000_0186}),  # another COB-ID
]


@pytest.mark.parametrize("content", DAMAGED + REFUSED, ids=lambda content: content[:60].decode("latin1"))
def test_a_file_that_cannot_be_used_starts_the_node_with_its_defaults_and_an_emergency(file, content):
    file.write_bytes(content)
    master = start(file, bit_rate=125_000)
    assert heartbeat_ms(master) == 1000
    assert master.send("605 40 01 10 00")[0].data[4] == 0x01
    assert master.send("605 40 03 10 01")[0].data[4:6] == bytes.fromhex("0063")
    assert master.node.storage.summary.startswith("not used: ")
    store(master, 0x1010, 1, SAVE)
    master.node.tick(master.now_s)
    assert master.send("605 40 01 10 00")[0].data[4] == 0
    assert start(file, bit_rate=125_000).node.storage.problem == ""


def test_a_device_in_place_of_the_file_does_not_prevent_the_start(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    assert start(pipe).node.storage.problem


@given(st.binary(max_size=200))
def test_any_bytes_in_the_file_are_refused(content):
    with pytest.raises(ValueError, match="it is damaged"):
        decode(content, NODE_ID)


GOOD = encode(StoredParameters(7, {(0x1017, 0): 500}), NODE_ID)


@given(st.integers(0, len(GOOD) - 1), st.integers(1, 255))
def test_a_changed_byte_is_found_or_changes_nothing(position, change):
    damaged = bytearray(GOOD)
    damaged[position] ^= change
    with suppress(ValueError):
        assert decode(bytes(damaged), NODE_ID) == decode(GOOD, NODE_ID)
