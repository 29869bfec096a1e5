"""What the instrument is asked, and what it does by itself, as the records tell it."""

import pytest

from instrument.coupling import Coupling
from instrument.events.witness import ALARM_OVER_S, Witness
from instrument.rig.frames import Fault
from registers.map import REGISTERS
from registers.source import Peer
from tests.instrument.driving import DT_S, HOLD, KEY, PLC, ROBOT, SETPOINT, VENT, Drive
from tests.instrument.events.keeping import Memory


class Watched:
    """A driven instrument with a witness between it and whoever asks."""

    def __init__(self, drive):
        self.drive, self.journal = drive, Memory()
        self.witness = Witness(Coupling(drive.instrument), self.journal, lambda: round(drive.now_s * 1e6))
        self.look()
        self.journal.records.clear()

    def look(self):
        self.witness.on_sample(self.drive.now_s)
        self.witness.tick(self.drive.now_s)

    def run(self, seconds):
        for _ in range(round(seconds / DT_S)):
            self.drive.run(DT_S)
            self.look()
        return self

    def write(self, values, peer=PLC):
        return str(self.witness.write(peer, values, self.drive.now_s))

    def told(self, kind):
        return self.journal.of(kind)


def test_a_write_is_put_down_with_who_old_new_and_verdict():
    watched = Watched(Drive.ready())
    watched.write(SETPOINT)
    watched.write({"setpoint_requested_kpa": 9.0, "force_limit_n": 2.0})
    assert watched.told("write")[1] == {
        "kind": "write",
        "who": "modbus_tcp 10.0.0.1",
        "values": {"setpoint_requested_kpa": (8.0, 9.0), "force_limit_n": (5.0, 2.0)},
        "verdict": "accepted",
    }


def test_a_refused_write_is_put_down_with_its_reason():
    watched = Watched(Drive.zeroed())
    assert watched.write(HOLD | SETPOINT) == "state"
    (told,) = watched.told("write")
    assert told["verdict"] == "state"
    assert told["values"]["mode"] == ("vent", "hold")


def test_a_vent_within_a_refused_write_is_told():
    watched = Watched(Drive.holding())
    watched.write({"lease_s": 1.0}, ROBOT)
    watched.write(VENT | {"force_limit_n": 3.0}, PLC)
    refused = watched.told("write")[1]
    assert (refused["verdict"], refused["vented"]) == ("lease", True)


def test_a_request_that_never_arrived_is_put_down_with_its_bytes():
    watched = Watched(Drive.ready())
    watched.witness.refused(Peer("can"), b"\x40\x1f", "length", watched.drive.now_s)
    assert watched.told("request") == [
        {"kind": "request", "who": "can", "request": "40 1f", "verdict": "length"}
    ]


def test_writing_the_same_again_and_again_is_one_record_until_it_ends():
    watched = Watched(Drive.holding())
    for _ in range(50):
        watched.write(HOLD | SETPOINT)
        watched.run(0.02)
    assert len(watched.told("write")) == 1
    watched.witness.end("asked", watched.drive.now_s)
    assert [(told["kind"], told.get("times")) for told in watched.journal.told[-2:]] == [
        ("repeated", 49),
        ("stop", None),
    ]


def test_a_command_block_written_each_cycle_is_one_record():
    watched = Watched(Drive.ready())
    for _ in range(5):
        watched.write(KEY | {"command_code": "self_test", "command_argument": 0, "command_sequence": 7})
    assert len(watched.told("write")) == 1


def test_what_another_changed_and_the_plc_changes_back_is_put_down_each_time():
    watched = Watched(Drive.ready())
    for _ in range(3):
        watched.write({"force_limit_n": 2.0}, PLC)
        watched.write({"force_limit_n": 3.0}, ROBOT)
    assert len(watched.told("write")) == 6


@pytest.mark.parametrize(("code", "verdict"), [("self_test", "done"), ("undo_zero", "state")])
def test_a_command_is_put_down_with_its_outcome(code, verdict):
    watched = Watched(Drive.ready())
    watched.write(KEY | {"command_code": code, "command_argument": 0, "command_sequence": 7})
    assert watched.told("answer") == [
        {"kind": "answer", "who": "modbus_tcp 10.0.0.1", "command": code, "verdict": verdict}
    ]


def test_the_outcome_of_a_clear_follows_when_the_board_has_answered():
    watched = Watched(Drive.ready())
    watched.drive.instrument.trip(Fault.LEAK)
    watched.write(KEY | {"command_code": "clear_faults", "command_argument": 0, "command_sequence": 7})
    assert watched.told("answer") == []
    watched.run(0.6)
    assert [told["verdict"] for told in watched.told("answer")] == ["done"]
    assert [told["is"] for told in watched.told("faults")] == [["leak"], []]


def test_a_trip_is_put_down_with_its_cause_before_it():
    watched = Watched(Drive.holding())
    watched.drive.instrument.trip(Fault.BURST)
    watched.look()
    assert [told["kind"] for told in watched.journal.told] == ["faults", "state"]
    assert watched.told("faults") == [{"kind": "faults", "was": [], "is": ["burst"]}]
    assert watched.told("state") == [{"kind": "state", "was": "holding", "is": "tripped"}]


def test_a_lease_that_runs_out_is_put_down():
    watched = Watched(Drive.holding())
    watched.write({"lease_s": 0.5})
    watched.run(1.0)
    assert [told["is"] for told in watched.told("faults")] == [["lease expired"]]


def test_a_vent_by_the_board_itself_is_seen_in_its_state():
    watched = Watched(Drive.holding())
    watched.drive.causes.add(Fault.OVERPRESSURE)
    watched.run(0.1)
    assert watched.told("faults")[0]["is"] == ["overpressure"]
    assert watched.told("state")[-1]["is"] == "tripped"


def test_the_zero_is_put_down_when_it_is_taken_and_forgotten():
    watched = Watched(Drive.new())
    watched.run(1.2)
    watched.drive.instrument.chain.zero.forget()
    watched.look()
    taken, forgotten = watched.told("zero_kpa")
    assert (taken["was"], forgotten["is"]) == (None, None)
    assert taken["is"] == pytest.approx(0.3, abs=0.03)


def test_a_force_that_hovers_at_its_limit_is_one_alarm():
    watched = Watched(Drive.ready())
    own = watched.drive.instrument
    calm, alarmed = own.measurement, own.measurement._replace(force_uncompensated_n=9.0)
    for step in range(200):
        own.measurement = alarmed if step % 2 else calm
        watched.drive.now_s += DT_S
        watched.look()
    assert [told["is"] for told in watched.told("force_alarm")] == [True]
    own.measurement = calm
    watched.drive.now_s += ALARM_OVER_S
    watched.look()
    assert [told["is"] for told in watched.told("force_alarm")] == [True, False]


def test_trouble_with_the_journal_is_maintenance_while_it_lasts():
    watched = Watched(Drive.holding())
    watched.journal.trouble = "disk full"
    watched.run(0.02)
    assert "maintenance" in watched.drive.see().status
    watched.journal.trouble = ""
    watched.run(0.02)
    assert "maintenance" not in watched.drive.see().status


def test_of_every_register_that_can_be_written_the_old_value_is_known():
    watched = Watched(Drive.ready())
    for quantity in {register.quantity for register in REGISTERS if register.writable}:
        watched.journal.records.clear()
        watched.write({quantity: getattr(watched.drive.see(), quantity)})
        for told in watched.told("write"):
            assert told["values"][quantity][0] is not None


def test_an_error_of_ours_in_putting_down_keeps_no_write_from_its_answer(monkeypatch, caplog):
    watched = Watched(Drive.holding())
    monkeypatch.setattr("instrument.events.witness.changes", lambda *_: 1 / 0)
    assert watched.write(VENT) == "none"
    assert not watched.drive.inflates
    monkeypatch.setattr("instrument.events.witness.standing", lambda *_: 1 / 0)
    assert watched.write(VENT) == "none"
    assert watched.write(VENT) == "none"
    assert [record.levelname for record in caplog.records].count("ERROR") <= 2
