"""Tests of the electronic data sheet: it has the keys of CiA 306, and python-canopen and Lely read it."""

import configparser
import io
import re
import subprocess
import sys
from pathlib import Path

import canopen
import pytest

from pneuforce.registers.can.frames import FRAMES
from pneuforce.registers.canopen.communication import REVISION, TPDOS, revision_number
from pneuforce.registers.canopen.entry import DataType
from pneuforce.registers.canopen.object_dictionary import ENTRIES, OBJECTS
from pneuforce.registers.map_hash import MAP_HASH
from pneuforce.registers.views import eds

NODE_ID = 9
DEPENDING_ON_THE_MAP = {REVISION: revision_number(MAP_HASH), (0x2302, 0): MAP_HASH}
TEXT = eds.render()
SHEET = configparser.RawConfigParser()
SHEET.optionxform = str
SHEET.read_string(TEXT)
HEADS = {"FileInfo", "DeviceInfo", "DummyUsage", "Comments"}
LISTS = {"MandatoryObjects", "OptionalObjects", "ManufacturerObjects"}

FILE_INFO = {"FileName", "FileVersion", "FileRevision", "EDSVersion", "Description", "CreationTime"}
FILE_INFO |= {"CreationDate", "CreatedBy", "ModificationTime", "ModificationDate", "ModifiedBy"}
DEVICE_INFO = {"VendorName", "VendorNumber", "ProductName", "ProductNumber", "RevisionNumber", "OrderCode"}
DEVICE_INFO |= {f"BaudRate_{rate}" for rate in (10, 20, 50, 125, 250, 500, 800, 1000)}
DEVICE_INFO |= {"SimpleBootUpMaster", "SimpleBootUpSlave", "Granularity", "DynamicChannelsSupported"}
DEVICE_INFO |= {"GroupMessaging", "NrOfRXPDO", "NrOfTXPDO", "LSS_Supported"}
ENTRY_KEYS = {"ParameterName", "ObjectType", "DataType", "AccessType", "PDOMapping"}


def read_sheet():
    file = io.StringIO(TEXT)
    file.name = "pneuforce.eds"
    return canopen.import_od(file, NODE_ID)


READ = read_sheet()

each_entry = pytest.mark.parametrize(
    "entry", ENTRIES, ids=lambda entry: f"{entry.index:04X}.{entry.subindex}"
)


def variable(entry):
    found = READ[entry.index]
    return found if isinstance(found, canopen.objectdictionary.ODVariable) else found[entry.subindex]


@each_entry
def test_python_canopen_reads_type_access_and_default_of_each_entry(entry):
    read = variable(entry)
    assert (read.data_type, read.access_type, read.pdo_mappable) == (
        entry.type.number, entry.access, entry.mappable
    )  # fmt: skip
    if entry.type is DataType.F32:
        assert read.default is None
    elif entry.field is not None and entry.field.constant is not None:
        assert read.default == entry.field.constant
    elif entry.default is not None:
        assert read.default == entry.default + NODE_ID * entry.adds_node_id
    else:
        assert read.default == DEPENDING_ON_THE_MAP.get(entry.address)


def test_a_master_can_compare_revision_and_map_hash_with_the_data_sheet():
    assert int(SHEET["DeviceInfo"]["RevisionNumber"], 0) == revision_number(MAP_HASH)
    assert f"{MAP_HASH:08x}" in SHEET["Comments"]["Line2"]


@each_entry
def test_the_limits_agree_with_the_node(entry):
    section = f"{entry.index:04X}"
    section = section if SHEET.has_option(section, "DataType") else f"{section}sub{entry.subindex:X}"
    limits = [SHEET.get(section, key, fallback=None) for key in ("LowLimit", "HighLimit")]
    expected = [None, None] if entry.type is DataType.F32 else [entry.low, entry.high]
    assert [None if text is None else float(text) for text in limits] == expected


def test_floats_have_no_values_because_readers_disagree_about_their_form():
    floats = [section for section in SHEET.values() if section.get("DataType") == "0x0008"]
    assert len(floats) > 10
    assert not any(key in section for section in floats for key in ("DefaultValue", "LowLimit", "HighLimit"))


def test_the_checker_of_lely_reports_nothing(tmp_path):
    sheet = tmp_path / "pneuforce.eds"
    sheet.write_text(TEXT, encoding="ascii")
    checker = Path(sys.executable).with_name("dcfchk")
    command = [checker, "--node_id", str(NODE_ID), sheet]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_python_canopen_finds_exactly_the_objects_of_the_dictionary():
    assert set(READ) == {object_.index for object_ in OBJECTS}


def test_the_head_has_every_key():
    assert set(SHEET["FileInfo"]) == FILE_INFO
    assert set(SHEET["DeviceInfo"]) >= DEVICE_INFO
    assert set(SHEET["DummyUsage"]) == {f"Dummy000{n}" for n in range(1, 8)}
    assert len(SHEET["Comments"]) == 1 + int(SHEET["Comments"]["Lines"])


def test_dates_and_times_have_the_format_of_the_standard():
    for what in ("Creation", "Modification"):
        assert re.fullmatch(r"(0[1-9]|1[0-2]):[0-5]\d(AM|PM)", SHEET["FileInfo"][f"{what}Time"])
        assert re.fullmatch(r"[01]\d-[0-3]\d-\d{4}", SHEET["FileInfo"][f"{what}Date"])


def listed(name):
    section = SHEET[name]
    numbers = range(1, int(section["SupportedObjects"]) + 1)
    assert set(section) == {"SupportedObjects", *map(str, numbers)}
    return [int(section[str(number)], 16) for number in numbers]


def test_each_object_is_in_the_list_for_its_index():
    assert listed("MandatoryObjects") == [0x1000, 0x1001, 0x1018]
    assert all(0x2000 <= index < 0x6000 for index in listed("ManufacturerObjects"))
    optional = listed("OptionalObjects")
    assert all(0x1000 <= index < 0x2000 or 0x6000 <= index < 0xA000 for index in optional)
    assert sorted(index for name in LISTS for index in listed(name)) == [object_.index for object_ in OBJECTS]


def test_each_section_is_an_object_that_is_listed_with_its_sub_indices():
    sections = set(SHEET.sections()) - HEADS - LISTS
    for object_ in OBJECTS:
        section = f"{object_.index:04X}"
        if SHEET.has_option(section, "SubNumber"):
            subs = {f"{section}sub{entry.subindex:X}" for entry in object_.entries}
            assert int(SHEET[section]["SubNumber"], 16) == len(subs)
            assert subs <= sections
            sections -= subs
        sections.discard(section)
    assert sections == set()


def test_each_entry_has_the_keys_of_an_entry():
    entries = [section for name, section in SHEET.items() if "DataType" in section]
    assert len(entries) == len(ENTRIES)
    assert all(set(section) >= ENTRY_KEYS for section in entries)
    assert {section["AccessType"] for section in entries} <= {"ro", "wo", "rw", "rww", "const"}


def test_the_text_is_ascii_with_short_lines():
    assert TEXT.isascii()
    assert max(map(len, TEXT.splitlines())) <= 255
    assert all(1 <= len(section.get("ParameterName", "x")) <= 241 for section in SHEET.values())


def test_the_mapping_covers_each_frame_byte_by_byte_and_only_mapped_entries_are_mappable():
    all_mapped = set()
    frames = [tpdo[0] for tpdo in TPDOS]
    mapped = [READ[0x1A00 + number] for number in range(4)] + [READ[0x1600]]
    commanded = next(frame for frame in FRAMES if frame.received)
    for frame, mapping in zip([*frames, commanded], mapped, strict=True):
        entries = [mapping[sub].default for sub in range(1, mapping[0].default + 1)]
        named = [READ[code >> 16][code >> 8 & 0xFF] for code in entries]
        assert [var.name for var in named] == [field.name for field in frame.fields]
        assert [len(var) for var in named] == [code & 0xFF for code in entries]
        assert sum(map(len, named)) == 8 * frame.length
        assert all(var.pdo_mappable for var in named)
        all_mapped |= {(var.index, var.subindex) for var in named}
    assert {entry.address for entry in ENTRIES if entry.mappable} == all_mapped


def test_identifiers_agree_with_the_frames():
    for number, (frame, *_) in enumerate(TPDOS):
        assert READ[0x1800 + number][1].default & 0x7FF == frame.base_id + NODE_ID
    assert READ[0x1400][1].default == 0x200 + NODE_ID
