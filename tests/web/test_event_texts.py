"""Tests of the texts of events: words instead of the names of registers, quantities and codes."""

import pytest

from pneuforce.instrument.core.faults import described
from pneuforce.registers.codes import COMMANDS, REJECT_REASONS
from pneuforce.registers.map import REGISTERS
from pneuforce.web.event_texts import event_message
from pneuforce.web.operator_texts import FAULT_TITLES

COMMAND = {
    "command_argument": [0, 12],
    "command_code": ["none", "new_balloon"],
    "command_key": [0, 0x5046],
    "command_sequence": [0, 1],
}
LOG = "/var/log_of_n/my_events.sqlite"
RECORDS = [
    ({"kind": "write", "values": {"force_limit_n": [0.5, 5.0]}}, "force limit 0.5 → 5 N"),
    ({"kind": "write", "values": COMMAND}, "command new balloon, argument 12"),
    (
        {"kind": "faults", "was": [], "is": ["vent shut (fault 9)", "burst (fault 5)"]},
        "none → vent valve stuck + burst",
    ),
    (
        {"kind": "write", "values": COMMAND | {"command_code": ["none", "clear_faults"]}},
        "command clear faults",
    ),
    (
        {"kind": "write", "values": {"setpoint_requested_kpa": ["nan", 8.0]}},
        "setpoint requested none → 8 kPa",
    ),
    ({"kind": "zero_kpa", "was": None, "is": 0.25}, "none → 0.25"),
    ({"kind": "file_changed", "why": f"{LOG} was removed"}, f"why {LOG} was removed"),
    ({"kind": "login", "who": "web 1.2.3.4", "result": "wrong_password"}, "web page 1.2.3.4: wrong password"),
    (
        {"kind": "login", "who": "web 1.2.3.4", "user": "eve", "result": "wrong_password"},
        "web page 1.2.3.4: user eve: wrong password",
    ),
    (
        {"kind": "logout", "who": "web anna@1.2.3.4", "result": "user_changed"},
        "web page anna@1.2.3.4: user changed",
    ),
    ({"kind": "start", "map_hash": "ab"}, "map hash ab"),
    (
        {"kind": "request", "who": "modbus_tcp 1.2.3.4", "written": "force_limit_mn 25000 mN", "allowed": ""},
        "Modbus TCP 1.2.3.4: force limit 25000 mN",
    ),
    ({"kind": "write", "values": {"command_code": 3}}, ""),  # a manipulated record
]


@pytest.mark.parametrize(("record", "text"), RECORDS)
def test_a_record_is_described_in_words(record, text):
    assert event_message({"at": "2027", **record})["text"] == text


def test_no_register_quantity_command_or_reject_reason_keeps_its_code_name():
    writable = [register for register in REGISTERS if register.writable]
    names = {name for register in writable for name in (register.name, register.quantity)}
    values = {name: [0, 1] for name in names - {"command_code"}}
    texts = [event_message({"kind": "write", "values": values})["text"]]
    texts += [event_message({"kind": "answer", "command": name})["text"] for name in COMMANDS.names.values()]
    texts += [event_message({"kind": "write", "result": name})["text"] for name in REJECT_REASONS.codes]
    assert [text for text in texts if "_" in text] == []


def test_the_kind_is_not_repeated_in_the_text():
    message = event_message({"at": "2027", "kind": "force_alarm", "was": False, "is": True})
    assert (message["kind"], message["text"]) == ("force alarm", "off → on")
    assert event_message({}) == {"at": "", "kind": "", "text": ""}


@pytest.mark.parametrize(("code", "title"), FAULT_TITLES.items())
def test_a_fault_has_the_same_title_as_in_the_list_of_faults(code, title):
    record = {"kind": "faults", "was": [], "is": [described(code)]}
    assert event_message(record)["text"] == f"none → {title}"
