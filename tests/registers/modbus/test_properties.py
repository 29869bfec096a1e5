"""What holds for any bytes: streams cut at will, garbage, and long stories of reads and writes."""

import socket
import struct
from contextlib import suppress

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from registers.map import BLOCKS
from registers.modbus.bank import Bank
from registers.modbus.identity import Identity
from registers.modbus.mbap import Decoder, Request, frame
from registers.modbus.pdu import Responder
from registers.source import Peer
from tests.registers.modbus.plain import MODE, LeasedSource, PlainServer
from tests.registers.modbus.serving import IDENTITY, connected, everything, serving, still_answers
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


def mask(address, keep, put):
    return struct.pack(">BHHH", 22, address, keep, put)


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


def responder(**options):
    read_only = options.pop("read_only", False)
    return Responder(Bank(**options), LeasedSource(), Identity(IDENTITY), read_only=read_only)


@given(st.lists(anything, max_size=12), st.lists(st.integers(0, 2000), max_size=20))
def test_any_split_of_any_requests_gives_the_same_answers_in_the_same_order(pdus, cuts):
    one_by_one, streamed, decoder = responder(), responder(), Decoder()
    expected = [one_by_one.answer(pdu, PEERS[0], 0.0) for pdu in pdus]
    stream = b"".join(frame(i, 1, pdu) for i, pdu in enumerate(pdus))
    received = [request for chunk in chunks(stream, cuts) for request in decoder.feed(chunk)]
    assert [r.transaction for r in received] == list(range(len(pdus)))
    assert [streamed.answer(r.pdu, PEERS[0], 0.0) for r in received] == expected


@pytest.fixture(scope="module")
def server():
    with serving(LeasedSource()) as server:
        yield server


@pytest.fixture(scope="module")
def alike():
    """A responder that is asked all that the server is asked."""
    return responder()


few = settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


@few
@given(pdus=st.lists(anything, min_size=1, max_size=30), cuts=st.lists(st.integers(0, 2000), max_size=12))
def test_so_it_is_through_a_socket(server, alike, pdus, cuts):
    expected = b"".join(frame(i, 1, alike.answer(pdu, PEERS[0], 0.0)) for i, pdu in enumerate(pdus))
    with connected(server) as client:
        client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        for chunk in chunks(b"".join(frame(i, 1, pdu) for i, pdu in enumerate(pdus)), cuts):
            client.sendall(chunk)
        client.shutdown(socket.SHUT_WR)
        assert everything(client) == expected


@given(st.lists(st.binary(max_size=600), max_size=6))
def test_a_decoder_takes_any_bytes_and_keeps_less_than_a_frame(pieces):
    decoder = Decoder()
    for piece in pieces:
        for request in decoder.feed(piece):
            assert isinstance(request, Request)
            assert 1 <= len(request.pdu) <= 253
        assert len(decoder._rest) < 260
        assert not (decoder.broken and decoder.unfinished)


@few
@given(garbage=st.lists(st.binary(min_size=1, max_size=400), max_size=5))
def test_any_bytes_to_a_socket_leave_the_others_unharmed(server, garbage):
    with connected(server) as client, connected(server) as other:
        with suppress(OSError):  # closed before all was sent
            for piece in garbage:
                client.sendall(piece)
            client.shutdown(socket.SHUT_WR)
        with suppress(ConnectionError):
            everything(client)
        assert still_answers(other)


class AgreesWithPlainWords(RuleBasedStateMachine):
    """Two peers, any requests: each answer, and all that is read afterwards, is as the reference has it."""

    @initialize(word_swap=st.booleans(), read_only=st.sampled_from((False, False, True)))
    def start(self, word_swap, read_only):
        self.plain = PlainServer(word_swap=word_swap, read_only=read_only)
        self.server = responder(word_swap=word_swap, read_only=read_only)

    def asked(self, pdu, peer):
        expected = self.plain.answer(pdu, peer)
        assert self.server.answer(pdu, peer, 0.0).hex(" ") == expected.hex(" ")
        return expected

    @rule(pdu=requests, peer=st.sampled_from(PEERS))
    def ask(self, pdu, peer):
        self.asked(pdu, peer)

    @rule(peer=st.sampled_from(PEERS), lease=st.sampled_from((0, 200, 60000)))
    def take_a_lease(self, peer, lease):
        self.asked(write_one(517, lease.to_bytes(2, "big")), peer)

    @rule(at=st.sampled_from((MODE, 522, 544)), keep=masks, put=masks, peer=st.sampled_from(PEERS))
    def change_bits(self, at, keep, put, peer):
        self.asked(mask(at, keep, put), peer)

    @rule(
        at=st.sampled_from((0, 127, 512, 544, 0xFFFF)),
        count=st.integers(1, 4),
        written=st.sampled_from(((512, FLOATS[0]), (512, FLOATS[1]), (MODE, WORDS[1]), (544, WORDS[5]))),
        peer=st.sampled_from(PEERS),
    )
    def write_and_read(self, at, count, written, peer):
        self.asked(exchange(at, count, *written), peer)

    @rule(peer=st.sampled_from(PEERS))
    def hold(self, peer):
        self.asked(write_one(MODE, b"\0\1"), peer)

    @rule(
        peer=st.sampled_from(PEERS),
        vent=st.sampled_from((write_one(MODE, b"\0\0"), write_many(MODE, b"\0\0"), mask(MODE, 0xFFFE, 0))),
    )
    def vent(self, peer, vent):
        assert self.asked(vent, peer)[0] < 0x80, "a vent is never refused"
        assert self.asked(read(3, MODE, 1), peer) == b"\3\2\0\0"

    @invariant()
    def all_that_is_shown_agrees(self):
        for peer in PEERS:
            for first, last in BLOCKS[:2]:
                self.asked(read(4, first, last + 1 - first if last - first < 125 else 125), peer)


AgreesWithPlainWords.TestCase.settings = settings(max_examples=60, stateful_step_count=30, deadline=None)
TestAgreesWithPlainWords = AgreesWithPlainWords.TestCase
