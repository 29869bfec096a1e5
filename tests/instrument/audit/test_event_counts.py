"""Tests of the counts of events that the audit logger makes, for monitoring."""

from pneuforce.instrument.core.event_counts import MAX_REASONS, OTHERS, EventCounts
from pneuforce.protocol.frames import Fault
from pneuforce.registers.source import Peer
from pneuforce.support.rejected_write import RejectedWrite
from tests.instrument.audit.test_audit_logger import LoggedInstrument
from tests.instrument.instrument_harness import DT_S, HOLD, KEY, PLC, SETPOINT, VENT, InstrumentHarness

CLEAR = KEY | {"command_code": "clear_faults", "command_argument": 0, "command_sequence": 7}


def counts_of(logged):
    return logged.logger.counts.values()


def test_a_trip_is_counted_once_with_each_of_its_faults():
    logged = LoggedInstrument(InstrumentHarness.holding())
    logged.harness.causes |= {Fault.OVERPRESSURE, Fault.LEAK}
    logged.run(0.1)
    counts = counts_of(logged)
    assert (counts["trips"], counts["vents"]) == (1, 0)
    assert counts["faults"] == {"4": 1, "11": 1}


def test_a_fault_that_occurs_again_after_a_clear_is_counted_again():
    logged = LoggedInstrument(InstrumentHarness.holding())
    for number in range(2):
        logged.harness.instrument.trip(Fault.BURST)
        logged.run(0.1)
        logged.write(CLEAR | {"command_sequence": 7 + number})
        logged.run(0.6)
    counts = counts_of(logged)
    assert (counts["trips"], counts["faults"]) == (2, {"5": 2})


def test_only_a_vent_of_an_inflated_balloon_is_counted():
    logged = LoggedInstrument(InstrumentHarness.holding())
    for _ in range(3):
        logged.write(VENT)
        logged.run(0.5)
    assert (counts_of(logged)["vents"], counts_of(logged)["trips"]) == (1, 0)


def test_rejected_writes_are_counted_by_reason_even_if_the_event_log_only_counts_them():
    logged = LoggedInstrument(InstrumentHarness.zeroed())
    for _ in range(500):
        logged.write(HOLD | SETPOINT)
    logged.write(SETPOINT)
    rejected = RejectedWrite(b"\x40\x1f", "illegal_value", "setpoint_requested = 8", "8 bytes")
    logged.logger.log_rejected_write(Peer(*PLC), rejected, logged.harness.now_s)
    assert counts_of(logged)["rejected_writes"] == {"state": 500, "illegal_value": 1}
    assert len(logged.records("write")) < 300


def test_failed_logins_are_counted_by_reason():
    logged = LoggedInstrument(InstrumentHarness.zeroed())
    logged.logger.log_failed_logins(Peer("web", "10.0.0.9"), "wrong_password", 4, 0.0)
    logged.logger.log_failed_logins(Peer("web", "10.0.0.8"), "wrong_password", 1, DT_S)
    assert counts_of(logged)["failed_logins"] == {"wrong_password": 5}


def test_a_failed_handshake_of_modbus_security_is_recorded_but_is_no_failed_login():
    logged = LoggedInstrument(InstrumentHarness.zeroed())
    logged.logger.log_failed_logins(Peer("modbus_tls", "10.0.0.9"), "unknown certificate", 4, 0.0)
    assert counts_of(logged)["failed_logins"] == {}
    assert [record["result"] for record in logged.records("login")] == ["unknown certificate"]


def test_the_number_of_reasons_is_limited():
    counts = EventCounts()
    for number in range(3 * MAX_REASONS):
        counts.count_rejected_write(f"reason {number}")
    counts.count_rejected_write("reason 0")
    assert len(counts.rejected_writes) == MAX_REASONS + 1
    assert counts.rejected_writes["reason 0"] == 2
    assert counts.rejected_writes[OTHERS] == 2 * MAX_REASONS
