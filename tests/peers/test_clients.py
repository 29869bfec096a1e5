"""Clients that others wrote, each over TCP and on a serial line, against the whole instrument."""

from importlib.metadata import version

import pytest

from registers.codes import STATES, STATUS
from registers.modbus.client import Plc
from tests.peers.clients.client import CLIENTS, Asking

TCP = [pytest.param((client, "tcp"), id=f"{client.name}-tcp", marks=client.needs) for client in CLIENTS]
RTU = [pytest.param((client, "rtu"), id=f"{client.name}-rtu", marks=client.needs) for client in CLIENTS]

PATTERN = {
    "ABCD": [0xC2F6, 0xE666, 0x1234, 0x5678, 0xCFC7],
    "CDAB": [0xE666, 0xC2F6, 0x5678, 0x1234, 0xCFC7],
}
BASIC = [["0", "pneuforce"], ["1", "PF-1"], ["2", version("pneuforce")]]
REGULAR = [*BASIC, ["3", ""], ["4", "Pneumatic force sensor"], ["5", "PF-1 field instrument"], ["6", ""]]
EXTENDED = [*REGULAR, ["128", "0"], ["129", ""]]

#: A write, a look at what it did, and what is then seen; the values of all of them differ.
WRITES = [
    ("word 544 6500", "float 512 {order}", [6.5]),
    ("put 544 8000 3500", "words 3 544 2", [8000, 3500]),
    ("put_float 512 5.25 {order}", "words 4 544 1", [5250]),
    (f"mask 544 {0xFF00} {0x0F58}", "words 3 544 1", [5250 & 0xFF00 | 0x58]),
    ("word 516 0", "words 3 516 1", [0]),
]

#: What not every client can ask for, and its answer.
SPECIAL = [
    ("exchange 544 1 544 7250", [7250]),
    ("exchange 544 1 544 5050", [5050]),
    ("identity 1 0", BASIC),
    ("identity 2 0", REGULAR),
    ("identity 3 0", EXTENDED),
    ("identity 4 4", [REGULAR[4]]),
    ("echo 42295", [0xA5, 0x37]),
    ("server_id", ["exception", 1]),
]

#: What is refused, and its exception code.
REFUSED = [
    ("words 3 128 1", 2),
    ("words 4 127 2", 2),
    ("bits 1 0 1", 2),
    ("bits 2 31 2", 2),
    ("coil 0 1", 2),
    ("coils 0 1 0 1", 2),
    ("word 0 1", 2),
    ("word 512 16544", 3),
    ("word 516 2", 3),
    ("word 544 12001", 3),
    ("put 544 8000 65535", 3),
    ("put_float 512 12.01 {order}", 3),
    ("put_float 512 -1 {order}", 3),
    ("put_float 512 nan {order}", 3),
    ("mask 512 0 16544", 3),
    ("exchange 0 2 0 1", 2),
    ("exchange 128 1 544 6000", 2),
    ("server_id", 1),
    ("identity 4 127", 2),
]


@pytest.fixture(scope="module", params=TCP + RTU)
def asking(request, instrument):
    client, wire = request.param
    with Asking(client, wire, instrument.port if wire == "tcp" else instrument.line) as asking:
        yield asking


def test_the_test_pattern_settles_the_word_order(asking):
    assert asking("words 3 3840 5") == asking("words 4 3840 5") == PATTERN[asking.order]
    assert asking("float 3840 {order}") == [pytest.approx(-123.45)]


def test_it_reads_each_block_and_the_status(asking, instrument):
    for address, count in ((0, 36), (0, 125), (512, 34), (768, 16)):
        assert len(asking(f"words 4 {address} {count}")) == count
    with Plc.connect(port=instrument.port) as plc:
        seen = plc.read()
    assert asking("words 3 25 1") == [STATES.codes[seen["state"]]]
    bits = asking("bits 2 0 32")
    told = {bit.name for bit in STATUS.bits if bits[bit.number]}
    assert told & {"inflating", "holding", "vented", "simulated", "not_zeroed"} == {"vented", "simulated"}


def test_what_it_writes_is_there(asking):
    for write, look, seen in WRITES:
        if asking.offers(write):
            assert (write, asking(write), asking(look)) == (write, [], seen)


def test_it_is_told_why_it_is_refused_and_nothing_changes(asking):
    assert asking("put 544 7777 2222") == []
    offered = [(request, code) for request, code in REFUSED if asking.offers(request)]
    assert [(request, asking(request)) for request, _ in offered] == [
        (request, ["exception", code]) for request, code in offered
    ]
    assert asking("words 3 544 2") == [7777, 2222]


def test_another_who_holds_the_lease_makes_it_wait_but_not_for_a_vent(asking, instrument):
    with instrument.leased():
        assert asking("word 544 4321") == ["exception", 6]
        assert asking("word 516 0") == []
    assert asking("word 544 4321") == []


def test_what_it_offers_beside_is_answered_too(asking):
    offered = [(request, answer) for request, answer in SPECIAL if asking.offers(request)]
    if not offered:
        pytest.skip("it offers nothing beside")
    assert [(request, asking(request)) for request, _ in offered] == offered


@pytest.mark.parametrize("asking", [p for p in TCP if "together" in p.values[0][0].requests], indirect=True)
def test_fifty_reads_at_once_are_each_answered_in_order(asking):
    assert asking("together 50") == [[which, PATTERN[asking.order][which % 5]] for which in range(50)]
