"""Tests of the Node-RED flows: their wires, and their reading of the registers in virtual time."""

import itertools
import json
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pneuforce.registers.advice import FAULT_ADVICE
from pneuforce.registers.codes import FAULTS, STATUS
from pneuforce.registers.document_text import MEASURED_BLOCK, name_with_unit
from pneuforce.registers.map import BY_NAME, REGISTERS
from pneuforce.registers.views import node_red, node_red_dashboard
from pneuforce.registers.views.node_red_nodes import node_id
from tests.peers.clients.client import NEEDS_NODE
from tests.registers.views.node_red_nodes import HELD, memory

FLOW, DASHBOARD = (json.loads(view.render()) for view in (node_red, node_red_dashboard))
FLOWS = pytest.mark.parametrize("nodes", [FLOW, DASHBOARD], ids=["flow", "dashboard"])
CORE = {"tab", "inject", "function", "link in", "link out", "debug"}
MODBUS = {"modbus-client", "modbus-flex-getter", "modbus-flex-write"}
PAGE = {
    f"ui-{kind}" for kind in ("base", "theme", "page", "group", "template", "text", "button", "number-input")
}
#: Properties that contain the identifier of a node, and the type of that node.
REFERENCES = {"z": "tab", "server": "modbus-client", "group": "ui-group", "page": "ui-page", "ui": "ui-base",
              "theme": "ui-theme"}  # fmt: skip
MEASURED = [register for register in REGISTERS if register.address in MEASURED_BLOCK]
counters = itertools.count(1)


@FLOWS
def test_every_wire_link_and_reference_leads_to_a_node(nodes):
    by_id = {node["id"]: node for node in nodes}
    assert len(by_id) == len(nodes)
    for node in nodes:
        for target in itertools.chain(*node.get("wires", ())):
            assert by_id[target]["z"] == node["z"]
            assert by_id[target]["type"] not in ("tab", "inject", "link in")
        for other in node.get("links", ()):
            assert node["id"] in by_id[other]["links"]
            assert {node["type"], by_id[other]["type"]} == {"link in", "link out"}
        for key, kind in REFERENCES.items():
            assert key not in node or by_id[node[key]]["type"] == kind, node["name"]


def test_the_flow_needs_only_the_modbus_nodes():
    assert {node["type"] for node in FLOW} == CORE | MODBUS
    assert {node["type"] for node in DASHBOARD} == CORE | MODBUS | PAGE


def test_the_dashboard_contains_the_same_flow():
    without_links = [{key: value for key, value in node.items() if key != "links"} for node in DASHBOARD]
    for node in FLOW:
        node = {key: value for key, value in node.items() if key != "links"}
        assert node in without_links


@FLOWS
def test_a_vent_button_is_wired_to_the_vent(nodes):
    by_id = {node["id"]: node for node in nodes}
    buttons = [n for n in nodes if n["type"] in ("inject", "ui-button") and n["topic"] == "vent"]
    assert buttons
    for button in buttons:
        (targets,) = button["wires"]
        for target in targets:
            if by_id[target]["type"] == "link out":
                (command,) = by_id[target]["links"]
                (targets,) = by_id[command]["wires"]
        assert node_id("Vent") in targets


def read(nodes, order="ABCD", **codes):
    """Return the reading of a cycle with a new sample."""
    (reading,) = nodes.read({**HELD, "sample_counter": next(counters), **codes}, order)
    return reading


CODES = {
    r.name: st.floats(width=32) | st.just(math.nan) if r.wire.min_code is None
    else st.integers(0, r.wire.max_code) | st.just(r.wire.max_code)
    for r in MEASURED
}  # fmt: skip


FORCES = ("force", "force_uncertainty", "force_uncompensated")
NEVER_VALID = {"stale", "link_lost", "failure"}


def expected_value(register, codes):
    """Return the value of a register in a reading; None if the value must be absent."""
    code, status = codes[register.name], STATUS.names(codes["status"])
    if register.name == "status":
        return sorted(status)
    if register.name == "state":
        return register.code_names.get(code, f"{code}?")
    if register.name in FORCES and (NEVER_VALID & status or not math.isfinite(codes["force"])):
        return None
    return code if math.isfinite(code) and code != register.not_available else None


@NEEDS_NODE
@settings(max_examples=50)
@given(codes=st.fixed_dictionaries(CODES), order=st.sampled_from(["ABCD", "CDAB"]))
def test_every_value_is_that_of_the_register_or_absent(node_process, codes, order):
    node_process.restart()
    read(node_process, order, sample_counter=codes["sample_counter"] ^ 1)
    (reading,) = node_process.read({**HELD, **codes}, order)
    reading["status"].sort()
    for register in MEASURED:
        value = reading.get(name_with_unit(register))
        value = float(value) if isinstance(value, int) else value
        assert value == expected_value(register, codes), register.name
    assert reading["valid"] == (expected_value(BY_NAME["force"], codes) is not None)


@NEEDS_NODE
@pytest.mark.parametrize("order", ["ABCD", "CDAB"])
def test_the_first_cycle_and_a_cycle_without_a_new_sample_give_no_force(nodes, order):
    assert not read(nodes, order)["valid"]
    reading = read(nodes, order)
    assert (reading["valid"], reading["force_n"], reading["word_order"]) == (True, 1.25, order)
    (reading,) = nodes.read({**HELD, "sample_counter": reading["sample_counter"]}, order)
    assert not reading["valid"]
    assert "force_n" not in reading
    assert "pressure_kpa" not in reading


@NEEDS_NODE
@pytest.mark.parametrize(
    "codes",
    [
        {"test_float": 123.45},
        {"test_long": 0x78563412},
        {"test_int": 1},
        {"map_hash": 1},
        {"map_version": 2},
        {"force": math.nan},
        {"force": math.inf},
        {"status": 4 | 1 << 8},
        {"status": 4 | 1 << 9},
        {"status": 4 | 1 << 27},
    ],
    ids=str,
)
def test_a_wrong_device_and_a_bad_status_give_no_force(nodes, codes):
    read(nodes)
    assert read(nodes)["valid"]
    reading = read(nodes, **codes)
    assert not reading["valid"]
    assert "force_n" not in reading
    assert reading["explanation"]


@NEEDS_NODE
@pytest.mark.parametrize(
    "changes", [{"payload": "", "error": {"message": "Timed out"}}, {"payload": [1]}], ids=str
)
def test_a_failed_read_gives_no_force_and_no_old_sample(nodes, changes):
    read(nodes)
    assert read(nodes)["valid"]
    (reading,) = nodes.read(HELD, **changes)
    assert reading == {"connected": False, "valid": False, "explanation": reading["explanation"]}
    assert not read(nodes)["valid"]
    assert read(nodes)["valid"]


@NEEDS_NODE
def test_a_late_answer_is_not_used(nodes):
    read(nodes)
    requests, _, _ = nodes.send("Read", "tick")
    late = {**HELD, "sample_counter": next(counters)}
    assert nodes.send("Read", "tick") == [[], [], []]
    _, (reading,), _ = nodes.send("Read", "tick")
    assert not reading["payload"]["connected"]
    assert [nodes.answer(request, memory(late)) for request in requests] == [[[], [], []]] * len(requests)


@NEEDS_NODE
def test_a_fault_has_its_remedy(nodes):
    for code, name in FAULTS.names.items():
        read(nodes)
        reading = read(nodes, first_out_fault=code)
        what, remedy = FAULT_ADVICE[code]
        expected = {"code": code, "name": name, "what": what, "remedy": remedy} if code else None
        assert reading.get("fault") == expected
        assert reading["valid"] == (code == 0)
    assert read(nodes, first_out_fault=99)["fault"]["name"] == "unknown"
