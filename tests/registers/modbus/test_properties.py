"""Property tests: streams cut at any position, garbage, and long sequences of reads and writes."""

import socket
import struct
from contextlib import suppress

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from pneuforce.registers.map import BLOCKS
from pneuforce.registers.modbus.device_identification import DeviceIdentification
from pneuforce.registers.modbus.mbap import MbapDecoder, MbapRequest, encode_frame
from pneuforce.registers.modbus.pdu import RequestHandler
from pneuforce.registers.modbus.register_bank import RegisterBank
from pneuforce.registers.source import Peer
from tests.registers.modbus.reference_bank import MODE, LeasedSource, ReferenceServer
from tests.registers.modbus.serving import IDENTITY, connected, read_until_closed, serving, still_answers
from tests.registers.modbus.test_mbap import chunks

PEERS = (Peer("modbus_tcp", "127.0.0.1"), Peer("modbus_tcp", "127.0.0.2"))
EDGES = sorted({a + i for block in BLOCKS for a in block for i in (-2, -1, 0, 1, 2)} - {-2, -1})
FLOATS = [struct.pack(">f", x) for x in (8.0, 2.0, 12.0, 5.5, 0.0, 12.01, float("nan"), float("inf"), -1.0)]
WORDS = [word.to_bytes(2, "big") for word in (0, 1, 2, 199, 200, 8000, 12000, 12001, 60000, 0x5046, 0xFFFF)]

addresses = st.one_of(
    st.integers(508, 550), st.sampled_from((512, 514, 516, 517, 544)), st.sampled_from(EDGES)
)
data = st.lists(st.sampled_from(FLOATS + WORDS), min_size=1, max_size=6).map(b"".join)
word = st.one_of(st.sampled_from(WORDS), st.binary(min_size=2, max_size=2))


def read(function, address, count):
    return struct.pack(">BHH", function, address, count)


def write_one(address, word):
    return struct.pack(">BH", 6, address) + word


def write_many(address, data):
    return struct.pack(">BHHB", 16, address, len(data) // 2, len(data)) + data


def mask(address, and_mask, or_mask):
    return struct.pack(">BHHH", 22, address, and_mask, or_mask)


def exchange(read_at, count, write_at, data):
    return struct.pack(">BHHHHB", 23, read_at, count, write_at, len(data) // 2, len(data)) + data


masks = st.sampled_from((0, 1, 0x00FF, 0xFFFE, 0xFFFF))
requests = st.one_of(
    st.builds(
        read, st.sampled_from((3, 4)), st.one_of(addresses, st.integers(0, 0xFFFF)), st.integers(0, 126)
    ),
    st.builds(write_one, addresses, word),
    st.builds(write_many, addresses, data),
    st.builds(mask, addresses, masks, masks),
    st.builds(exchange, addresses, st.integers(0, 40), addresses, data),
)
anything = st.one_of(requests, st.binary(min_size=1, max_size=40).filter(lambda pdu: pdu[0] < 0x80))


def request_handler(**options):
    writable = () if options.pop("read_only", False) else None
    return RequestHandler(
        RegisterBank(**options), LeasedSource(), DeviceIdentification(IDENTITY), writable=writable
    )


@given(st.lists(anything, max_size=12), st.lists(st.integers(0, 2000), max_size=20))
def test_any_split_of_any_requests_gives_the_same_answers_in_the_same_order(pdus, cuts):
    one_by_one, streamed, decoder = request_handler(), request_handler(), MbapDecoder()
    expected = [one_by_one.answer(pdu, PEERS[0], 0.0) for pdu in pdus]
    stream = b"".join(encode_frame(i, 1, pdu) for i, pdu in enumerate(pdus))
    received = [request for chunk in chunks(stream, cuts) for request in decoder.feed(chunk)]
    assert [r.transaction for r in received] == list(range(len(pdus)))
    assert [streamed.answer(r.pdu, PEERS[0], 0.0) for r in received] == expected


@pytest.fixture(scope="module")
def server():
    with serving(LeasedSource()) as server:
        yield server


@pytest.fixture(scope="module")
def reference():
    """Return a request handler that gives the expected answers to the requests sent to the server."""
    return request_handler()


few = settings(max_examples=25)


@few
@given(pdus=st.lists(anything, min_size=1, max_size=30), cuts=st.lists(st.integers(0, 2000), max_size=12))
def test_any_split_gives_the_same_answers_through_a_socket(server, reference, pdus, cuts):
    expected = b"".join(
        encode_frame(i, 1, reference.answer(pdu, PEERS[0], 0.0)) for i, pdu in enumerate(pdus)
    )
    with connected(server) as client:
        client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        for chunk in chunks(b"".join(encode_frame(i, 1, pdu) for i, pdu in enumerate(pdus)), cuts):
            client.sendall(chunk)
        client.shutdown(socket.SHUT_WR)
        assert read_until_closed(client) == expected


@given(st.lists(st.binary(max_size=600), max_size=6))
def test_the_decoder_accepts_any_bytes_and_buffers_less_than_a_frame(pieces):
    decoder = MbapDecoder()
    for piece in pieces:
        for request in decoder.feed(piece):
            assert isinstance(request, MbapRequest)
            assert 1 <= len(request.pdu) <= 253
        assert len(decoder._rest) < 260
        assert not (decoder.error and decoder.is_incomplete)


@few
@given(garbage=st.lists(st.binary(min_size=1, max_size=400), max_size=5))
def test_any_bytes_on_one_connection_leave_other_connections_working(server, garbage):
    with connected(server) as client, connected(server) as other:
        with suppress(OSError):  # the server closed the connection before all bytes were sent
            for piece in garbage:
                client.sendall(piece)
            client.shutdown(socket.SHUT_WR)
        with suppress(ConnectionError):
            read_until_closed(client)
        assert still_answers(other)


class AgreesWithReferenceServer(RuleBasedStateMachine):
    """Two peers send random requests. All answers and values agree with the reference server."""

    @initialize(word_swap=st.booleans(), read_only=st.sampled_from((False, False, True)))
    def start(self, word_swap, read_only):
        self.reference = ReferenceServer(word_swap=word_swap, read_only=read_only)
        self.server = request_handler(word_swap=word_swap, read_only=read_only)

    def check(self, pdu, peer):
        expected = self.reference.answer(pdu, peer)
        assert self.server.answer(pdu, peer, 0.0).hex(" ") == expected.hex(" ")
        return expected

    @rule(pdu=requests, peer=st.sampled_from(PEERS))
    def send_any_request(self, pdu, peer):
        self.check(pdu, peer)

    @rule(peer=st.sampled_from(PEERS), lease=st.sampled_from((0, 200, 60000)))
    def take_a_lease(self, peer, lease):
        self.check(write_one(517, lease.to_bytes(2, "big")), peer)

    @rule(at=st.sampled_from((MODE, 522, 544)), and_mask=masks, or_mask=masks, peer=st.sampled_from(PEERS))
    def change_bits(self, at, and_mask, or_mask, peer):
        self.check(mask(at, and_mask, or_mask), peer)

    @rule(
        at=st.sampled_from((0, 127, 512, 544, 0xFFFF)),
        count=st.integers(1, 4),
        written=st.sampled_from(((512, FLOATS[0]), (512, FLOATS[1]), (MODE, WORDS[1]), (544, WORDS[5]))),
        peer=st.sampled_from(PEERS),
    )
    def write_and_read(self, at, count, written, peer):
        self.check(exchange(at, count, *written), peer)

    @rule(peer=st.sampled_from(PEERS))
    def hold(self, peer):
        self.check(write_one(MODE, b"\0\1"), peer)

    @rule(
        peer=st.sampled_from(PEERS),
        vent=st.sampled_from((write_one(MODE, b"\0\0"), write_many(MODE, b"\0\0"), mask(MODE, 0xFFFE, 0))),
    )
    def vent(self, peer, vent):
        assert self.check(vent, peer)[0] < 0x80, "a vent is never rejected"
        assert self.check(read(3, MODE, 1), peer) == b"\3\2\0\0"

    @invariant()
    def all_readable_values_agree(self):
        for peer in PEERS:
            for first, last in BLOCKS[:2]:
                self.check(read(4, first, last + 1 - first if last - first < 125 else 125), peer)


AgreesWithReferenceServer.TestCase.settings = settings(max_examples=60, stateful_step_count=30)
TestAgreesWithReferenceServer = AgreesWithReferenceServer.TestCase
