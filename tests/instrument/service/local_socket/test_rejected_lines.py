"""Tests of the lines about rejected writes: each bus names peer, register, value and limit."""

import logging

import pytest

from pneuforce.instrument.audit.audit_logger import AuditLogger
from pneuforce.instrument.audit.wording import describe_record
from pneuforce.instrument.config import Configuration
from pneuforce.instrument.core.peers import PeerRecord
from pneuforce.instrument.core.reject_reason import REMEDIES, RejectReason
from pneuforce.instrument.core.requests import log_write
from pneuforce.instrument.core.session import Session
from pneuforce.instrument.recording.broadcaster import EntryBroadcaster
from pneuforce.instrument.service.local_socket.server import LocalServer
from pneuforce.instrument.stream.entry import EntryKind, json_entry
from pneuforce.registers.can.frames import COMMAND, encode
from pneuforce.registers.can.node import CanNode
from pneuforce.registers.can.options import CanOptions
from pneuforce.registers.can.wire import CanFrame
from pneuforce.registers.canopen.node import CanopenNode
from pneuforce.registers.field import quantity_unit
from pneuforce.registers.map import REGISTERS
from pneuforce.registers.modbus.device_identification import DeviceIdentification
from pneuforce.registers.modbus.pdu import RequestHandler
from pneuforce.registers.modbus.register_bank import RegisterBank
from pneuforce.registers.modbus.rtu import RtuTiming, encode_frame
from pneuforce.registers.modbus.rtu_unit import ModbusRtuUnit
from pneuforce.registers.rdt.record import RdtCommand, encode_request
from pneuforce.support.throttle import MAX_LINES
from tests.instrument.audit.event_log_files import MemorySink
from tests.instrument.instrument_harness import PLC, InstrumentHarness
from tests.registers.canopen.fake_master import IDENTITY as CANOPEN_IDENTITY
from tests.registers.canopen.fake_master import parse_frame
from tests.registers.modbus.serving import IDENTITY
from tests.registers.rdt.serving import client_of, serving

HOLD = {"setpoint": 8.0, "mode": "hold", "sequence": 7, "lease": 0.0, "proof_test": "allowed"}
GOOD = encode(COMMAND, None, **HOLD)
START = "000 01 05"
TIMING = RtuTiming(19200)
SILENCE_S = 0.1
OTHER_SETPOINT = b"\x00\x20" + GOOD[2:]


class Buses:
    """Servers of all buses for one instrument with an event log."""

    def __init__(self):
        harness = InstrumentHarness.zeroed()
        self.sink, self.now_s = MemorySink(), harness.now_s
        session = Session(harness.instrument, EntryBroadcaster())
        self.source = AuditLogger(session, self.sink)
        self.local = LocalServer(session, self.source, session.sink, Configuration(), lambda now_s: {})

    def modbus_tcp(self, pdu, **options):
        identification = DeviceIdentification(IDENTITY)
        handler = RequestHandler(RegisterBank(), self.source, identification, **options)
        return handler.answer(bytes.fromhex(pdu), PLC, self.now_s)

    def modbus_rtu(self, pdu):
        unit = ModbusRtuUnit(self.source, 1, TIMING, IDENTITY)
        unit.feed(encode_frame(1, bytes.fromhex(pdu)), self.now_s)
        unit.answer(self.now_s + SILENCE_S)

    def can(self, *commands):
        node = CanNode(self.source, CanOptions())
        for data in commands:
            node.receive(CanFrame(0x205, data), self.now_s)

    def canopen(self, *frames):
        node = CanopenNode(self.source, CanOptions(), CANOPEN_IDENTITY)
        node.tick(self.now_s)
        for frame in frames:
            node.receive(parse_frame(frame), self.now_s)

    def web(self, values, seen_s=None):
        seen_s = seen_s if seen_s is not None else 0.0
        facts = {"values": values, "seen_s": seen_s, "address": "10.0.0.7"}
        self.local.answer(json_entry(EntryKind.WRITE, 0.0, facts), "web")


TCP, RANGE_KPA = "modbus_tcp 10.0.0.1", ("2", "12 kPa")
CASES = [
    # bus, what is sent, and what the line contains
    ("modbus_rtu", ["06 0220 30d4"], ("modbus_rtu", "setpoint_requested_pa", "12500 Pa", "2000", "12000 Pa")),
    ("modbus_tcp", ["10 0200 0002 04 41500000"], (TCP, "setpoint_requested", "13 kPa", *RANGE_KPA)),
    ("modbus_tcp", ["10 0200 0002 04 7fc00000"], (TCP, "setpoint_requested", "nan", *RANGE_KPA)),
    ("modbus_tcp", ["06 0204 0007"], (TCP, "mode", "7", "vent", "hold")),
    ("modbus_tcp", ["06 0208 0001"], (TCP, "command_key 1", "must be 20550")),
    ("modbus_tcp", ["06 0200 4100"], (TCP, "setpoint_requested", "both words")),
    ("modbus_tcp", ["06 0000 0001"], (TCP, "force", "read-only")),
    ("modbus_tcp", ["10 0000 0002 04 00000000"], (TCP, "force", "0 N", "read-only")),
    ("modbus_tcp", ["06 ffff 0001"], (TCP, "65535", "0001h", "no register")),
    ("modbus_tcp", ["16 0204 0000 0007"], (TCP, "mode", "0007h", "vent", "hold")),
    ("modbus_tcp", ["17 0000 0002 0205 0001 02 0001"], (TCP, "lease", "1 ms", "200", "60000 ms")),
    ("modbus_tcp", ["05 0000 ff00"], (TCP, "coil", "00 00 ff 00")),
    ("modbus_tcp", ["10 0200 0002 05 4100000000"], (TCP, "length")),
    ("can", [GOOD[:7]], ("can", GOOD[:7].hex(" "), "8", "7")),
    ("can", [b"\xff\xff" + GOOD[2:]], ("can", "setpoint 65535 Pa", "mode hold", "2000", "12000 Pa")),
    ("can", [GOOD[:2] + b"\x09" + GOOD[3:]], ("can", "mode 9", "clear_faults")),
    ("can", [GOOD, OTHER_SETPOINT], ("can", "setpoint 8192 Pa", "sequence 7")),
    ("canopen", ["605 23 00 22 00 00 00 50 41"], ("can", "2200h", "setpoint_requested 13 kPa", *RANGE_KPA)),
    ("canopen", ["605 2B 04 22 00 07 00"], ("can", "2204h", "mode 7", "vent", "hold")),
    ("canopen", ["605 23 00 20 00 00 00 00 00"], ("can", "2000h", "force 0 N", "read-only")),
    ("canopen", ["605 2B 19 20 00 04 00"], ("can", "2019h", "state holding", "read-only")),
    ("canopen", ["605 2B 00 50 00 34 12"], ("can", "5000h:0", "1234h", "does not exist")),
    ("canopen", [START, "205 FE FF" + GOOD[2:].hex()], ("can", "setpoint 65534 Pa", "2000", "12000 Pa")),
    ("canopen", ["205 " + GOOD.hex()], ("can", "setpoint 8000 Pa", "mode hold", "pre_operational", "NMT")),
    ("web", [{"setpoint_requested": 13}], ("web 10.0.0.7", "setpoint_requested", "13", *RANGE_KPA)),
    ("web", [{"setpoint_requested": 8}], ("web 10.0.0.7", "old")),
]


@pytest.fixture(scope="module")
def buses():
    return Buses()


@pytest.mark.parametrize(("bus", "sent", "facts"), CASES)
def test_a_rejected_write_is_one_line_with_peer_register_value_and_limit(buses, bus, sent, facts, caplog):
    buses.sink.records.clear()
    buses.now_s += 10.0
    with caplog.at_level(logging.WARNING):
        getattr(buses, bus)(*sent)
    (line,) = [message for message in caplog.messages if " wrote " in message]
    assert all(fact in line for fact in facts)
    (record,) = buses.sink.of_kind("request")
    shown = " ".join((record["who"], describe_record(record), record["result"]))
    assert all(fact in shown for fact in facts)


def test_a_read_only_interface_names_the_register_of_a_write(buses, caplog):
    buses.now_s += 10.0
    buses.modbus_tcp("10 0200 0002 04 41000000", writable=())
    assert "setpoint_requested 8 kPa" in caplog.text
    assert "this interface, or the role of this client" in caplog.text


def test_a_write_that_the_instrument_rejects_is_one_line_with_peer_value_and_reason(buses, caplog):
    buses.now_s += 10.0
    with caplog.at_level(logging.INFO):
        buses.modbus_tcp("10 0200 0006 0c 41000000 40a00000 0001 03e8")
    (line,) = [message for message in caplog.messages if TCP in message]
    assert all(fact in line for fact in ("setpoint_requested 8 kPa", "mode hold", "lease 1 s"))


def test_an_invalid_write_does_not_change_the_reject_reason(buses):
    """The documents of register 27 say so."""
    assert buses.modbus_tcp("06 0204 0001") == bytes.fromhex("86 06")
    reason = buses.modbus_tcp("03 001b 0001")
    assert reason != bytes.fromhex("03 02 0000")
    assert buses.modbus_tcp("06 0204 0007") == bytes.fromhex("86 03")
    assert buses.modbus_tcp("03 001b 0001") == reason


@pytest.mark.parametrize("reason", [reason for reason in RejectReason if reason is not RejectReason.NONE])
def test_the_line_of_a_rejection_by_the_instrument_has_a_remedy(reason, caplog):
    with caplog.at_level(logging.INFO):
        log_write(PLC, {"mode": "hold"}, PeerRecord(reject_reason=reason))
    assert f"rejected, {reason}: {REMEDIES[reason]}" in caplog.text


@pytest.mark.parametrize("register", [register for register in REGISTERS if register.writable])
def test_an_accepted_write_is_logged_with_the_name_of_its_register(register, caplog):
    canonical = next(other for other in REGISTERS if other.writable and other.quantity == register.quantity)
    value = register.decode(next(iter(register.code_names), register.low or 0))
    with caplog.at_level(logging.INFO):
        log_write(PLC, {register.quantity: value}, PeerRecord())
    assert f" wrote {canonical.name} " in caplog.text
    assert caplog.messages[0].split(": accepted")[0].endswith(quantity_unit(register.unit))


def test_a_refused_request_over_rdt_names_the_client_and_the_request(caplog):
    with serving() as loop, client_of(loop) as client:
        client.send(encode_request(RdtCommand.SET_BIAS, 3))
        client.send(b"no request")
        loop.tick(0.0)
        host, port = client.getsockname()
    assert all(f"rdt {host}:{port}" in line for line in caplog.messages)
    assert f"command {RdtCommand.SET_BIAS:d}" in caplog.messages[0]
    assert b"no request".hex(" ") in caplog.messages[1]


def test_a_flood_on_one_bus_does_not_hide_a_rejected_write_on_another_bus(buses, caplog):
    buses.now_s += 10.0
    for _ in range(100):
        buses.modbus_tcp("06 0204 0007")
    buses.can(GOOD[:7])
    assert len(caplog.messages) == MAX_LINES + 1
    assert GOOD[:7].hex(" ") in caplog.messages[-1]
