"""Tests of the LSS slave (CiA 305) in virtual time. tests/system/test_canopen.py has a real LSS master."""

import struct

import pytest

from pneuforce.instrument.audit.audit_logger import AuditLogger, NullAuditSink
from pneuforce.instrument.core.session import Session
from pneuforce.registers.can.options import CanOptions
from pneuforce.registers.canopen.communication import PRODUCT_CODE, revision_number
from pneuforce.registers.canopen.node import CanopenNode
from pneuforce.registers.map_hash import MAP_HASH
from tests.instrument.instrument_harness import HOLD_8, ROBOT, InstrumentHarness
from tests.registers.can.fake_source import FakeSource
from tests.registers.canopen.cases import OPERATIONAL, PRE, STOPPED
from tests.registers.canopen.fake_master import IDENTITY, FakeMaster, parse_frame
from tests.registers.canopen.test_storage import start, wait_for_response

REVISION, SERIAL = revision_number(MAP_HASH), 4711
ADDRESS = (0, PRODUCT_CODE, REVISION, SERIAL)
VENTED, HOLDING = frozenset({"vented"}), frozenset({"holding", "force_valid"})
CONFIGURE, WAIT = (0x04, 1), (0x04, 0)


def source(**values):
    return FakeSource(**{"serial_number": SERIAL, "status": VENTED, "mode": "vent"} | values)


def request(master, service, *data):
    """Send a request of bytes, or of one 32-bit number; return the responses without trailing zeros."""
    raw = struct.pack("<I", data[0]) if len(data) == 1 and service >= 0x40 else bytes(data)
    frames = master.send(f"7E5 {(bytes((service,)) + raw).ljust(8, bytes(1)).hex(' ')}")
    assert all(len(frame.data) == 8 for frame in frames)
    return [(frame.id, frame.data.rstrip(b"\0")) for frame in frames]


def select(master, address=ADDRESS):
    return [request(master, 0x40 + n, number) for n, number in enumerate(address)][-1]


def identify(master, numbers):
    return [request(master, 0x46 + n, number) for n, number in enumerate(numbers)][-1]


@pytest.fixture
def file(tmp_path):
    return tmp_path / "canopen.json"


@pytest.fixture
def master():
    return FakeMaster(source=source())


@pytest.mark.parametrize("state", [PRE, OPERATIONAL, STOPPED])
def test_a_master_selects_the_node_by_its_address_and_reads_it_back(state):
    master = FakeMaster(state, source=source())
    assert request(master, 0x5E) == []
    assert select(master) == [(0x7E4, b"\x44")]
    read = [request(master, 0x5A + n)[0][1][1:].ljust(4, b"\0") for n in range(4)]
    assert [int.from_bytes(data, "little") for data in read] == list(ADDRESS)
    assert request(master, 0x5E) == [(0x7E4, b"\x5e\x05")]
    assert request(master, *WAIT) == []
    assert request(master, 0x5E) == []


@pytest.mark.parametrize("wrong", range(4))
def test_another_address_does_not_select_the_node(master, wrong):
    address = [number + (place == wrong) for place, number in enumerate(ADDRESS)]
    assert select(master, address) == []
    assert request(master, 0x5E) == []


def test_an_incomplete_address_does_not_select_the_node(master):
    select(master, ADDRESS[:3])
    request(master, *WAIT)
    assert [request(master, 0x41 + n, number) for n, number in enumerate(ADDRESS[1:])][-1] == [
        (0x7E4, b"\x44")
    ]
    request(master, *WAIT)
    assert request(master, 0x43, SERIAL) == []


EVERY = (0, 0xFFFF_FFFF)


@pytest.mark.parametrize(
    ("numbers", "found"),
    [
        ((0, PRODUCT_CODE, *EVERY, *EVERY), True),
        ((0, PRODUCT_CODE, REVISION, REVISION, SERIAL, SERIAL), True),
        ((1, PRODUCT_CODE, *EVERY, *EVERY), False),
        ((0, PRODUCT_CODE + 1, *EVERY, *EVERY), False),
        ((0, PRODUCT_CODE, 0, REVISION - 1, *EVERY), False),
        ((0, PRODUCT_CODE, *EVERY, SERIAL + 1, 0xFFFF_FFFF), False),
    ],
)
def test_a_master_finds_the_node_in_a_range_of_addresses(master, numbers, found):
    assert identify(master, numbers) == ([(0x7E4, b"\x4f")] if found else [])
    assert request(master, 0x4B, 0xFFFF_FFFF) == []  # the other numbers are missing


def test_a_configured_node_id_is_used_after_a_reset(master):
    request(master, *CONFIGURE)
    assert request(master, 0x11, 7) == [(0x7E4, b"\x11")]
    assert request(master, 0x5E) == [(0x7E4, b"\x5e\x05")]
    assert [(f.id, f.data) for f in master.send("000 82 05")] == [(0x707, b"\0")]
    assert request(master, 0x5E) == [(0x7E4, b"\x5e\x07")]
    assert master.send("605 40 00 10 00") == []
    assert master.send("607 40 00 18 01 00 00 00 00")[0].data[4:] == bytes.fromhex("87010040")
    master.send("000 01 07")
    master.send("207 00 00 00 01 00 00 00 00")
    assert master.source.written[-1]["mode"] == "vent"
    assert master.node.transmit_ids >= {0x187, 0x587, 0x707}


@pytest.mark.parametrize("node_id", [0, 128, 254, 255])
def test_an_invalid_node_id_is_refused(master, node_id):
    request(master, *CONFIGURE)
    assert request(master, 0x11, node_id) == [(0x7E4, b"\x11\x01")]
    assert master.send("000 82 05")[0].id == 0x705


@pytest.mark.parametrize(
    ("mode", "status"),
    [("hold", HOLDING), ("hold", VENTED), ("vent", frozenset()), ("vent", frozenset({"stale"}))],
)
def test_an_inflated_balloon_keeps_its_node_id_so_that_no_vent_is_lost(mode, status):
    master = FakeMaster(source=source(mode=mode, status=status))
    request(master, *CONFIGURE)
    request(master, 0x11, 7)
    assert master.send("000 81 05")[0].id == 0x705
    master.send("205 00 00 00 01 00 00 00 00")
    assert master.source.written[-1]["mode"] == "vent"
    master.source.set(mode="vent", status=VENTED)
    assert master.send("000 81 05")[0].id == 0x707


def test_no_vent_is_lost_if_the_node_is_reset_in_an_inflation_or_in_a_hold():
    harness = InstrumentHarness.ready()
    node = CanopenNode(AuditLogger(Session(harness.instrument), NullAuditSink()), CanOptions(), IDENTITY)
    node.tick(harness.now_s)
    for request_ in ("7E5 04 01 00 00 00 00 00 00", "7E5 11 07 00 00 00 00 00 00"):
        node.receive(parse_frame(request_), harness.now_s)
    harness.write(HOLD_8, ROBOT)
    for _ in range(100):
        node.receive(parse_frame("000 81 05"), harness.now_s)
        assert node.options.node_id == 5
        harness.run(0.05)
    assert harness.commands_hold
    node.receive(parse_frame("205 00 00 00 01 00 00 00 00"), harness.now_s)
    harness.run(0.1)
    assert not harness.commands_hold
    node.receive(parse_frame("000 81 05"), harness.now_s)
    assert node.options.node_id == 5  # the balloon is not yet empty


def test_no_lss_request_writes_to_the_instrument(master):
    for service in range(256):
        request(master, *CONFIGURE)
        request(master, service, 7)
    master.wait(0.1)
    assert (master.source.written, master.source.masters_lost_s) == ([], [])


@pytest.mark.parametrize(
    ("table", "index", "error"),
    [(0, 2, 0), (0, 0, 1), (0, 4, 1), (0, 5, 1), (0, 9, 1), (0, 255, 1), (1, 2, 1)],
)
def test_only_the_present_bit_rate_can_be_configured(master, table, index, error):
    request(master, *CONFIGURE)
    assert request(master, 0x13, table, index) == [(0x7E4, bytes((0x13, error)).rstrip(b"\0"))]
    assert request(master, 0x15, 10, 0) == []


def test_a_stored_node_id_is_used_after_a_restart(file):
    master = start(file, source=source())
    request(master, *CONFIGURE)
    request(master, 0x11, 7)
    assert request(master, 0x17) == []
    assert wait_for_response(master, 0x7E4).data == bytes.fromhex("1700000000000000")
    assert start(file).node.options.node_id == 7
    changed = start(file, node_id=9)  # the node id was changed in the configuration afterwards
    assert (changed.node.options.node_id, bool(changed.node.storage.problem)) == (9, True)


def test_a_file_that_cannot_be_written_is_an_access_error(file):
    master = start(file / "no folder" / "canopen.json")
    request(master, *CONFIGURE)
    request(master, 0x17)
    assert wait_for_response(master, 0x7E4).data[:2] == b"\x17\x02"


def test_without_a_file_storing_is_not_supported(master):
    request(master, *CONFIGURE)
    assert request(master, 0x17) == [(0x7E4, b"\x17\x01")]


@pytest.mark.parametrize("frame", ["7E5", "7E5 04 01", "7E5 04 01 00 00 00 00 00"])
def test_a_request_of_another_length_is_ignored(master, frame):
    assert master.send(frame) == []
    assert request(master, 0x5E) == []
    assert master.node.counters.ignored == 1


def test_requests_for_other_slaves_are_not_counted_as_ignored(master):
    for service in (0x5A, 0x5E, 0x11, 0x17, 0x4C, 0x51):
        assert request(master, service, 0) == []
    assert master.node.counters.ignored == 0
