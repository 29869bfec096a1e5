"""Tests of the generated documents."""

import csv
import json
import re
from pathlib import Path

import pytest

from pneuforce.registers.can.frames import FRAMES
from pneuforce.registers.codes import CONDENSED, STATUS
from pneuforce.registers.document_text import ENUMERATIONS
from pneuforce.registers.map import REGISTERS
from pneuforce.registers.map_hash import MAP_HASH
from pneuforce.registers.views import VIEWS
from pneuforce.registers.views.map_files_page import json_objects
from pneuforce.registers.views.tree_json import tree

TOP = Path(__file__).parents[3]


@pytest.mark.parametrize("form", VIEWS)
def test_the_committed_copy_is_current(form):
    view = VIEWS[form]
    assert (TOP / view.path).read_text(encoding="utf-8") == view.render(), (
        "run: python -m pneuforce.registers.views"
    )


@pytest.mark.parametrize("register", REGISTERS, ids=lambda r: r.name)
def test_the_page_lists_each_register_with_its_three_addresses(register):
    access = "RW" if register.writable else "R"
    row = re.compile(
        rf"\| {register.address} \| {register.address:04X}h \| {register.address + 1} \| `{register.name}` \|"
        rf".*\| {access} \| {re.escape(register.doc)} \|"
    )
    assert row.search(VIEWS["md"].render())


def test_every_row_of_the_page_has_as_many_cells_as_its_head():
    head = 0
    for line in VIEWS["md"].render().splitlines():
        cells = line.count("|")
        if line.startswith("|"):
            assert not head or cells == head, line
        head = cells if line.startswith("|") else 0


def test_the_page_names_every_bit_value_and_frame():
    page = VIEWS["md"].render()
    names = [bit.name for bits in (STATUS, CONDENSED) for bit in bits.bits]
    names += [name for values in ENUMERATIONS.values() for name in values.names.values()]
    names += [f"{frame.name}: {frame.base_id:03X}h + N" for frame in FRAMES]
    assert [name for name in names if name not in page] == []


def test_the_page_shows_which_bits_latch():
    page = VIEWS["md"].render().split("## Status bits")[1].split("## ")[0]
    latching = {
        int(row.split("|")[1]) for row in page.splitlines() if "| latches | " in row and "bit |" not in row
    }
    assert (
        latching == {bit.number for bit in STATUS.bits if bit.latches} == {7, *range(10, 15), 18, 20, 21, 22}
    )


def test_the_table_has_a_row_for_each_register_and_each_field():
    rows = list(csv.DictReader(VIEWS["csv"].render().splitlines()))
    modbus = [(int(r["address"]), r["name"], r["access"]) for r in rows if r["bus"] == "modbus"]
    assert modbus == [(r.address, r.name, "RW" if r.writable else "R") for r in REGISTERS]
    can = [(r["frame"], int(r["address"]), r["name"]) for r in rows if r["bus"] == "can"]
    assert can == [(frame.name, at, field.name) for frame in FRAMES for at, field in frame.field_offsets]


def test_the_table_has_each_address_in_every_notation():
    for row in csv.DictReader(VIEWS["csv"].render().splitlines()):
        if row["bus"] == "modbus":
            at = int(row["address"])
            numbers = [int(row[key]) for key in ("number", "input_register", "holding_register")]
            assert numbers == [at + 1, 30001 + at, 40001 + at]
            assert int(row["address_hex"], 16) == at
            assert int(row["words"]) == (2 if "32" in row["type"] else 1)


def test_the_table_contains_unit_range_and_not_available_code():
    rows = {(r["bus"], r["frame"], r["name"]): r for r in csv.DictReader(VIEWS["csv"].render().splitlines())}
    setpoint = rows["can", "Command", "setpoint"]
    assert [setpoint[key] for key in ("can_id", "unit", "low", "high", "access")] == [
        "205", "Pa", "2000", "12000", "W"
    ]  # fmt: skip
    assert rows["can", "Force", "force"]["not_available"] == "7FFFh"
    assert rows["modbus", "", "radius_um"]["not_available"] == "FFFFh"
    assert rows["modbus", "", "force"]["not_available"] == "NaN"
    assert rows["modbus", "", "lease"]["also_allowed"] == "0"
    assert rows["modbus", "", "answer_state"]["values"] == "0 idle; 1 busy; 2 done; 3 failed"
    assert "; 11 leak; " in rows["modbus", "", "first_out_fault"]["values"]
    assert "; 65291 leak; " in rows["can", "Emergency", "error_code"]["values"]
    assert {int(row["map_hash"]) for row in rows.values()} == {MAP_HASH}


@pytest.mark.parametrize("kind", json_objects(tree()), ids=lambda kind: kind.title)
def test_each_key_of_the_json_document_is_described_and_each_described_key_exists(kind):
    assert set(kind.keys) == set().union(*kind.objects)
    rows = VIEWS["map-files"].render().split(f"### {kind.title}\n")[1].split("###")[0]
    always = {key for key in kind.keys if f"| `{key}` | always |" in rows}
    assert always == set(kind.objects[0]).intersection(*kind.objects)


def test_each_column_of_the_table_is_described():
    head = VIEWS["csv"].render().partition("\n")[0].split(",")
    section = VIEWS["map-files"].render().split("## Columns")[1].split("## ")[0]
    assert re.findall(r"^\| `(\w+)` \| \S", section, re.MULTILINE) == head


def test_the_json_document_agrees_with_the_map():
    parsed = json.loads(VIEWS["json"].render())
    assert parsed["map_hash"] == MAP_HASH
    assert [(r["address"], r["name"]) for r in parsed["registers"]] == [
        (r.address, r.name) for r in REGISTERS
    ]
    assert parsed["enumerations"]["state"]["4"] == "holding"
    assert all(name.isidentifier() for name in parsed["enumerations"])
    fields = [
        *parsed["registers"],
        *(field for frame in parsed["can"]["frames"] for field in frame["fields"]),
    ]
    named = [field for field in fields if "enumeration" in field]
    assert all(field["values"] == parsed["enumerations"][field["enumeration"]] for field in named)
    assert {field["enumeration"] for field in named} >= {"state", "fault", "lease_holder", "reject_reason"}
    assert {f["name"]: f["base_id"] for f in parsed["can"]["frames"]} == {f.name: f.base_id for f in FRAMES}
