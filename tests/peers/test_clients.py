"""Tests of the complete instrument with Modbus clients of other projects, over TCP and on a serial line."""

from importlib.metadata import version

import pytest

from pneuforce.registers.codes import STATES, STATUS
from pneuforce.registers.modbus.client import ModbusClient
from tests.peers.clients.client import CLIENTS, RunningClient

TCP = [pytest.param((client, "tcp"), id=f"{client.name}-tcp", marks=client.needs) for client in CLIENTS]
RTU = [pytest.param((client, "rtu"), id=f"{client.name}-rtu", marks=client.needs) for client in CLIENTS]

PATTERN = {
    "ABCD": [0xC2F6, 0xE666, 0x1234, 0x5678, 0xCFC7],
    "CDAB": [0xE666, 0xC2F6, 0x5678, 0x1234, 0xCFC7],
}
BASIC = [["0", "pneuforce"], ["1", "PF-1"], ["2", version("pneuforce")]]
REGULAR = [*BASIC, ["3", ""], ["4", "Pneumatic force sensor"], ["5", "PF-1 field instrument"], ["6", ""]]
EXTENDED = [*REGULAR, ["128", "0"], ["129", ""]]

#: A write, a read of the written registers, and the values read. No value occurs twice.
WRITES = [
    ("word_write 544 6500", "float 512 {order}", [6.5]),
    ("words_write 544 8000 3500", "words 3 544 2", [8000, 3500]),
    ("float_write 512 5.25 {order}", "words 4 544 1", [5250]),
    (f"mask 544 {0xFF00} {0x0F58}", "words 3 544 1", [5250 & 0xFF00 | 0x58]),
    ("word_write 516 0", "words 3 516 1", [0]),
]

#: Requests that not every client supports, and their answers.
FURTHER_REQUESTS = [
    ("exchange 544 1 544 7250", [7250]),
    ("exchange 544 1 544 5050", [5050]),
    ("identity 1 0", BASIC),
    ("identity 2 0", REGULAR),
    ("identity 3 0", EXTENDED),
    ("identity 4 4", [REGULAR[4]]),
    ("echo 42295", [0xA5, 0x37]),
    ("server_id", ["exception", 1]),
]

#: Requests that the instrument rejects, and the exception codes of the answers.
REJECTED = [
    ("words 3 128 1", 2),
    ("words 4 127 2", 2),
    ("bits 1 0 1", 2),
    ("bits 2 31 2", 2),
    ("coil_write 0 1", 2),
    ("coils_write 0 1 0 1", 2),
    ("word_write 0 1", 2),
    ("word_write 512 16544", 3),
    ("word_write 516 2", 3),
    ("word_write 544 12001", 3),
    ("words_write 544 8000 65535", 3),
    ("float_write 512 12.01 {order}", 3),
    ("float_write 512 -1 {order}", 3),
    ("float_write 512 nan {order}", 3),
    ("mask 512 0 16544", 3),
    ("exchange 0 2 0 1", 2),
    ("exchange 128 1 544 6000", 2),
    ("server_id", 1),
    ("identity 4 127", 2),
]


@pytest.fixture(scope="module", params=TCP + RTU)
def client(request, instrument):
    type_, transport = request.param
    with RunningClient(
        type_, transport, instrument.port if transport == "tcp" else instrument.line
    ) as running:
        yield running


def test_the_test_pattern_shows_the_word_order(client):
    assert client("words 3 3840 5") == client("words 4 3840 5") == PATTERN[client.order]
    assert client("float 3840 {order}") == [pytest.approx(-123.45)]


def test_the_client_reads_each_block_and_the_status(client, instrument):
    for address, count in ((0, 36), (0, 125), (512, 34), (768, 16)):
        assert len(client(f"words 4 {address} {count}")) == count
    with ModbusClient.connect(port=instrument.port) as plc:
        seen = plc.read()
    assert client("words 3 25 1") == [STATES.codes[seen["state"]]]
    bits = client("bits 2 0 32")
    names = {bit.name for bit in STATUS.bits if bits[bit.number]}
    assert names & {"inflating", "holding", "vented", "simulated", "not_zeroed"} == {"vented", "simulated"}


def test_written_values_are_read_back(client):
    for write, read, expected in WRITES:
        if client.supports(write):
            assert (write, client(write), client(read)) == (write, [], expected)


def test_rejected_requests_return_exceptions_and_change_nothing(client):
    assert client("words_write 544 7777 2222") == []
    supported = [(request, code) for request, code in REJECTED if client.supports(request)]
    assert [(request, client(request)) for request, _ in supported] == [
        (request, ["exception", code]) for request, code in supported
    ]
    assert client("words 3 544 2") == [7777, 2222]


def test_the_lease_of_another_peer_rejects_writes_but_not_a_vent(client, instrument):
    with instrument.leased():
        assert client("word_write 544 4321") == ["exception", 6]
        assert client("word_write 516 0") == []
    assert client("word_write 544 4321") == []


def test_further_requests_of_the_client_are_answered(client):
    supported = [(request, answer) for request, answer in FURTHER_REQUESTS if client.supports(request)]
    if not supported:
        pytest.skip("this client supports no further requests")
    assert [(request, client(request)) for request, _ in supported] == supported


@pytest.mark.parametrize("client", [p for p in TCP if "together" in p.values[0][0].requests], indirect=True)
def test_fifty_reads_at_once_are_answered_in_order(client):
    assert client("together 50") == [[which, PATTERN[client.order][which % 5]] for which in range(50)]
