"""Tests of the records that the audit logger makes of writes and of changes of the instrument."""

import pytest

from pneuforce.instrument.audit.audit_logger import ALARM_HOLD_S, AuditLogger
from pneuforce.instrument.core.event_log_head import EventLogHead
from pneuforce.instrument.core.session import Session
from pneuforce.protocol.frames import Fault
from pneuforce.registers.map import REGISTERS
from pneuforce.registers.source import Peer
from pneuforce.support.rejected_write import RejectedWrite
from tests.instrument.audit.event_log_files import MemorySink
from tests.instrument.instrument_harness import (
    DT_S,
    FOREIGN_FIRMWARE,
    HOLD,
    KEY,
    OUR_FIRMWARE,
    PLC,
    ROBOT,
    SETPOINT,
    VENT,
    InstrumentHarness,
    hello_of,
)


class LoggedInstrument:
    """Instrument with an audit logger between the instrument and the peers."""

    def __init__(self, harness):
        self.harness, self.sink = harness, MemorySink()
        self.logger = AuditLogger(Session(harness.instrument), self.sink, lambda: round(harness.now_s * 1e6))
        self.update()
        self.sink.records.clear()

    def update(self):
        self.logger.on_sample(self.harness.now_s)
        self.logger.tick(self.harness.now_s)

    def run(self, seconds):
        for _ in range(round(seconds / DT_S)):
            self.harness.run(DT_S)
            self.update()
        return self

    def write(self, values, peer=PLC):
        return str(self.logger.write(peer, values, self.harness.now_s))

    def records(self, kind):
        return self.sink.of_kind(kind)


def test_a_write_is_logged_with_peer_old_value_new_value_and_result():
    logged = LoggedInstrument(InstrumentHarness.ready())
    logged.write(SETPOINT)
    logged.write({"setpoint_requested_kpa": 9.0, "force_limit_n": 2.0})
    assert logged.records("write")[1] == {
        "kind": "write",
        "who": "modbus_tcp 10.0.0.1",
        "values": {"setpoint_requested_kpa": (8.0, 9.0), "force_limit_n": (5.0, 2.0)},
        "result": "accepted",
    }


def test_a_rejected_write_is_logged_with_its_reason():
    logged = LoggedInstrument(InstrumentHarness.zeroed())
    assert logged.write(HOLD | SETPOINT) == "state"
    (record,) = logged.records("write")
    assert record["result"] == "state"
    assert record["values"]["mode"] == ("vent", "hold")


def test_the_record_of_the_board_names_its_firmware_and_an_image_that_was_not_released():
    logged = LoggedInstrument(InstrumentHarness.ready())
    logged.harness.instrument.identify_board(hello_of(), None)  # a new handshake has begun
    logged.run(0.02)
    logged.harness.instrument.identify_board(hello_of(), FOREIGN_FIRMWARE)
    logged.run(0.02)
    assert logged.records("board") == [
        {
            "kind": "board",
            "was": f"simulated, serial 1, firmware 1.2, image {OUR_FIRMWARE.image_crc:08X}",
            "is": "simulated, serial 1, firmware 1.2, image DEADBEEF: the image on the board is not a "
            "released image",
        }
    ]


def test_a_vent_within_a_rejected_write_is_logged():
    logged = LoggedInstrument(InstrumentHarness.holding())
    logged.write({"lease_s": 1.0}, ROBOT)
    logged.write(VENT | {"force_limit_n": 3.0}, PLC)
    record = logged.records("write")[1]
    assert (record["result"], record["vented"]) == ("lease", True)


def test_a_request_that_the_server_rejected_is_logged_with_its_bytes():
    logged = LoggedInstrument(InstrumentHarness.ready())
    rejected = RejectedWrite(b"\x40\x1f", "length", "Command 40 1f", "8 bytes")
    logged.logger.log_rejected_write(Peer("can"), rejected, logged.harness.now_s)
    assert logged.records("request") == [
        {
            "kind": "request",
            "who": "can",
            "request": "40 1f",
            "written": "Command 40 1f",
            "allowed": "8 bytes",
            "result": "length",
        }
    ]


def test_repeated_equal_writes_are_one_record_and_one_count():
    logged = LoggedInstrument(InstrumentHarness.holding())
    for _ in range(50):
        logged.write(HOLD | SETPOINT)
        logged.run(0.02)
    assert len(logged.records("write")) == 1
    logged.logger.end("stop requested", logged.harness.now_s)
    assert [(record["kind"], record.get("times")) for record in logged.sink.fields[-2:]] == [
        ("repeated", 49),
        ("stop", None),
    ]


def test_a_command_block_written_each_cycle_is_one_record():
    logged = LoggedInstrument(InstrumentHarness.ready())
    for _ in range(5):
        logged.write(KEY | {"command_code": "self_test", "command_argument": 0, "command_sequence": 7})
    assert len(logged.records("write")) == 1


def test_each_write_that_changes_a_value_is_logged():
    logged = LoggedInstrument(InstrumentHarness.ready())
    for _ in range(3):
        logged.write({"force_limit_n": 2.0}, PLC)
        logged.write({"force_limit_n": 3.0}, ROBOT)
    assert len(logged.records("write")) == 6


@pytest.mark.parametrize(("code", "result"), [("self_test", "done"), ("restore_zero", "state")])
def test_the_answer_to_a_command_is_logged(code, result):
    logged = LoggedInstrument(InstrumentHarness.ready())
    logged.write(KEY | {"command_code": code, "command_argument": 0, "command_sequence": 7})
    assert logged.records("answer") == [
        {"kind": "answer", "who": "modbus_tcp 10.0.0.1", "command": code, "result": result}
    ]


def test_the_answer_to_a_clear_is_logged_when_the_board_has_answered():
    logged = LoggedInstrument(InstrumentHarness.ready())
    logged.harness.instrument.trip(Fault.LEAK)
    logged.write(KEY | {"command_code": "clear_faults", "command_argument": 0, "command_sequence": 7})
    assert logged.records("answer") == []
    logged.run(0.6)
    assert [record["result"] for record in logged.records("answer")] == ["done"]
    assert [record["is"] for record in logged.records("faults")] == [["leak (fault 11)"], []]


def test_the_fault_is_logged_before_the_trip():
    logged = LoggedInstrument(InstrumentHarness.holding())
    logged.harness.instrument.trip(Fault.BURST)
    logged.update()
    assert [record["kind"] for record in logged.sink.fields] == ["faults", "state"]
    assert logged.records("faults") == [{"kind": "faults", "was": [], "is": ["burst (fault 5)"]}]
    assert logged.records("state") == [{"kind": "state", "was": "holding", "is": "tripped"}]


def test_an_expired_lease_is_logged():
    logged = LoggedInstrument(InstrumentHarness.holding())
    logged.write({"lease_s": 0.5})
    logged.run(1.0)
    assert [record["is"] for record in logged.records("faults")] == [["lease expired (fault 32)"]]


def test_a_trip_by_the_board_is_logged():
    logged = LoggedInstrument(InstrumentHarness.holding())
    logged.harness.causes.add(Fault.OVERPRESSURE)
    logged.run(0.1)
    assert logged.records("faults")[0]["is"] == ["overpressure (fault 4)"]
    assert logged.records("state")[-1]["is"] == "tripped"


def test_taking_and_clearing_the_zero_is_logged():
    logged = LoggedInstrument(InstrumentHarness.new())
    logged.run(1.2)
    logged.harness.instrument.chain.zero.clear()
    logged.update()
    taken, cleared = logged.records("zero_kpa")
    assert (taken["was"], cleared["is"]) == (None, None)
    assert taken["is"] == pytest.approx(0.3, abs=0.03)


def test_a_force_that_varies_around_its_limit_is_one_alarm():
    logged = LoggedInstrument(InstrumentHarness.ready())
    instrument = logged.harness.instrument
    low = instrument.measurement
    high = low._replace(force_uncompensated_n=9.0)
    for step in range(200):
        instrument.measurement = high if step % 2 else low
        logged.harness.now_s += DT_S
        logged.update()
    assert [record["is"] for record in logged.records("force_alarm")] == [True]
    instrument.measurement = low
    logged.harness.now_s += ALARM_HOLD_S
    logged.update()
    assert [record["is"] for record in logged.records("force_alarm")] == [True, False]


def test_the_second_alarm_has_its_own_records():
    logged = LoggedInstrument(InstrumentHarness.ready())
    alarm = logged.harness.instrument.alarm_2
    for alarm.active in (True, False, True, False):
        logged.update()
    logged.harness.now_s += ALARM_HOLD_S
    logged.update()
    assert [record["is"] for record in logged.records("force_alarm_2")] == [True, False]
    assert not logged.records("force_alarm")


def test_the_buses_show_the_head_of_the_log():
    logged = LoggedInstrument(InstrumentHarness.ready())
    logged.sink.head = EventLogHead(7, bytes(range(1, 33)))
    logged.run(DT_S)
    seen = logged.harness.snapshot()
    assert (seen.event_log_records, seen.event_log_digest_1) == (7, 0x0102_0304)
    assert seen.event_log_digest_2 == 0x0506_0708


def test_a_write_error_of_the_log_sets_the_maintenance_bit_while_it_lasts():
    logged = LoggedInstrument(InstrumentHarness.holding())
    logged.sink.write_error = "disk full"
    logged.run(0.02)
    assert "maintenance_required" in logged.harness.snapshot().status
    logged.sink.write_error = ""
    logged.run(0.02)
    assert "maintenance_required" not in logged.harness.snapshot().status


def test_the_old_value_of_each_writable_register_is_logged():
    logged = LoggedInstrument(InstrumentHarness.ready())
    for quantity in {register.quantity for register in REGISTERS if register.writable}:
        logged.sink.records.clear()
        logged.write({quantity: getattr(logged.harness.snapshot(), quantity)})
        for record in logged.records("write"):
            assert record["values"][quantity][0] is not None


def test_a_programming_error_in_the_logger_does_not_stop_a_write(monkeypatch, caplog):
    logged = LoggedInstrument(InstrumentHarness.holding())
    monkeypatch.setattr("pneuforce.instrument.audit.audit_logger.changes", lambda *_: 1 / 0)
    assert logged.write(VENT) == "none"
    assert not logged.harness.commands_hold
    monkeypatch.setattr("pneuforce.instrument.audit.audit_logger.writable_values", lambda *_: 1 / 0)
    assert logged.write(VENT) == "none"
    assert logged.write(VENT) == "none"
    assert [record.levelname for record in caplog.records].count("ERROR") <= 2
