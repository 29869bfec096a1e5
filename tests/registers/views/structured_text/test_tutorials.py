"""Tests of the programs in the PLC tutorials: syntax, names, and runs with the instrument in virtual time."""

import re

import pytest

from pneuforce.registers.codes import FAULTS, REJECT_REASONS
from pneuforce.registers.document_text import DIAGNOSTIC_BLOCK, MEASURED_BLOCK, TEST_BLOCK
from pneuforce.registers.map import BY_NAME
from tests.instrument.instrument_harness import ROBOT
from tests.registers.views.structured_text.controller import Controller
from tests.registers.views.structured_text.parsing import tree_of
from tests.registers.views.structured_text.sources import EXTENDED_PROGRAM, SOURCE, members, members_of
from tests.registers.views.structured_text.tutorials import FOLDER, TUTORIALS

LEASE = next(code for code, name in REJECT_REASONS.names.items() if name == "lease")
each_tutorial = pytest.mark.parametrize("tutorial", TUTORIALS, ids=lambda tutorial: tutorial.file)


@each_tutorial
def test_blark_parses_the_programs(tutorial):
    sources = tutorial.sources()
    assert len(sources) == (3 if tutorial.fence == "scl" else 2)
    for source in sources:
        assert tree_of(source).items


@each_tutorial
def test_the_read_requests_agree_with_the_map(tutorial):
    master = tutorial.sources()[0]
    requests = re.findall(r"First := (\d+);\s+Quantity := (\d+);", master)
    ranges = [range(int(first), int(first) + int(count)) for first, count in requests]
    answers = range(BY_NAME["answer_sequence"].address, BY_NAME["answer_result"].end)
    assert {TEST_BLOCK, MEASURED_BLOCK, answers, DIAGNOSTIC_BLOCK} == set(ranges)
    assert ("3840", "5") in requests
    assert "First : UDINT := 3840" in master or "First : UINT := 3840" in master


@each_tutorial
def test_the_address_of_the_instrument_is_a_declaration_and_no_literal_in_a_call(tutorial):
    _, _, body = tutorial.sources()[0].rpartition("END_VAR")
    assert not re.search(r"5020|\b502\b|192", body)


def test_the_diagnostic_values_contain_all_faults_and_the_firmware():
    names = {name for name, _ in members("TYPE", "PF_DIAGNOSTIC_VALUES")}
    assert {"LatchedFaults1", "LatchedFaults2"} <= names
    assert {"FirmwareVersion", "FirmwareOrigin", "FirmwareImage"} <= names


@each_tutorial
def test_the_program_uses_existing_names_of_the_blocks(tutorial):
    master, program, *_ = tutorial.sources()
    blocks = {"Order": "PF_WordOrder", "Reading": "PF_Reading", "Pressure": "PF_Pressure"}
    names = {variable: {name for name, _ in members_of(block)} for variable, block in blocks.items()}
    names["Master"] = set(re.findall(r"^    (\w+) : ", master, re.MULTILINE))
    for variable, known in names.items():
        assert set(re.findall(rf"\b{variable}\.(\w+)", program)) <= known
        [call] = re.findall(rf"^    {variable}\((.*?)\);", program, re.MULTILINE | re.DOTALL)
        assert set(re.findall(r"(\w+) :=", call)) <= known
    values = {name for name, _ in members("TYPE", "PF_VALUES")}
    assert set(re.findall(r"Reading\.Values\.(\w+)", program)) <= values


@each_tutorial
def test_the_lease_survives_one_lost_answer(tutorial):
    text = (FOLDER / tutorial.file).read_text(encoding="utf-8")
    lease_ms = int(re.search(r"Lease_ms := (\d+)", text)[1])
    [renew_ms] = re.findall(r"RenewEvery : TIME := T#(\d+)ms", SOURCE)
    assert lease_ms >= 2 * 1000 * tutorial.timeout_s + int(renew_ms)
    stated = {"T#500ms", "`RCV_TIMEOUT` of the instance (`PF_Master`, `Client`) to 0.5 s", ":= 500000"}
    assert tutorial.timeout_s == 0.5
    assert any(timeout in text for timeout in stated)


def test_the_changes_for_tia_portal_are_complete():
    text = (FOLDER / "tia-portal.md").read_text(encoding="utf-8")
    table = text[text.index("| part of pneuforce.st |") : text.index("`PF_Decode` computes a REAL")]
    parts = [
        part
        for row in re.findall(r"^\| (.*?) \|", table, re.MULTILINE)
        for part in re.findall("`(.*?)`", row)
    ]
    code = re.sub(r"\(\*.*?\*\)", "", SOURCE, flags=re.DOTALL)
    assert [part for part in parts if part not in code] == []
    assert set(re.findall(r"D?WORD#\d+\b(?!#)", code)) == {p for p in parts if "WORD#" in p}
    shifts = re.findall(r"SH[LR]\((?:\w+\(\w+\)|\w+), \d+\)", code)
    assert set(shifts) == {p for p in parts if p.startswith("SH")}
    assert len(shifts) == len(re.findall(r"\bSH[LR]\(", code))
    assert set(re.findall(r"(?<= : )TON\b", code)) == {"TON"}


@each_tutorial
@pytest.mark.usefixtures("blocks")
class TestWithTheInstrument:
    @pytest.mark.parametrize("word_swap", [False, True])
    def test_the_force_is_read_and_a_vent_follows_at_once(self, tutorial, word_swap):
        plc = Controller(tutorial, word_swap).run(1.0)
        assert (plc.program["Order.Known"], plc.program["Reading.Fresh"]) == (1, 1)
        assert plc.program["MayPush"] == 0
        plc.run(3.0, Inflate=1)
        assert plc.state == "holding"
        assert plc.program["MayPush"] == 1
        plc.harness.push_kpa = 3.5
        plc.run(1.0)
        assert plc.program["Reading.Values.Force_N"] == pytest.approx(
            plc.harness.snapshot().force_n, abs=0.05
        )
        assert plc.program["MayPush"] == 0
        plc.harness.push_kpa = 0.0
        plc.run(0.3, Inflate=0)
        assert plc.state in ("venting", "vented")
        gaps_s = [b - a for a, b in zip(plc.reads_s, plc.reads_s[1:], strict=False)]
        assert (round(min(gaps_s), 2), round(max(gaps_s), 2)) == (0.06, 0.09)
        assert "60 to 90 ms" in (FOLDER / tutorial.file).read_text(encoding="utf-8")

    def test_a_withdrawn_inflation_is_not_sent_later_than_two_cycles(self, tutorial):
        late_s = []
        for cycles in range(5, 18):
            plc = Controller(tutorial).run(1.0)
            plc.program["Inflate"] = 1
            for _ in range(30 + cycles):
                plc.cycle()
            sent, withdrawn_s = len(plc.written), plc.harness.now_s
            plc.run(0.1, Inflate=0)
            late_s += [t_s - withdrawn_s for t_s, *write in plc.written[sent:] if write == [516, 1]]
        assert late_s
        assert max(late_s) <= 0.021

    def test_a_pulled_cable_makes_the_force_invalid_and_requests_no_inflation_afterwards(self, tutorial):
        plc = Controller(tutorial).run(1.0).run(3.0, Inflate=1)
        assert plc.program["MayPush"] == 1
        plc.line_cut = True
        plc.run(1.0)
        assert (plc.program["MayPush"], plc.program["Reading.Values.Force_N"]) == (0, 5.0)
        plc.run(3.0)
        assert plc.state == "tripped"
        plc.line_cut = False
        plc.run(4.0)
        assert plc.program["Reading.Fresh"] == 1
        assert plc.state == "tripped"
        plc.run(1.0, Inflate=0)
        plc.run(1.5, ClearFaults=1)
        assert plc.program["Pressure.CommandDone"] == 1
        plc.run(4.0, Inflate=1, ClearFaults=0)
        assert plc.program["MayPush"] == 1

    def test_pushing_is_not_allowed_after_the_lease_expired_in_a_contact(self, tutorial):
        plc = Controller(tutorial).run(1.0).run(3.0, Inflate=1)
        plc.harness.push_kpa = 1.2
        plc.run(1.0)
        assert plc.program["MayPush"] == 1
        plc.line_cut = True
        plc.run(2.6)
        plc.line_cut = False
        plc.run(1.0)
        assert (plc.state, plc.program["Pressure.Holding"], plc.program["MayPush"]) == ("holding", 1, 0)

    def test_pushing_is_not_allowed_with_a_simulated_rig(self, tutorial):
        plc = Controller(tutorial).run(1.0, AllowSimulatedRig=0).run(3.0, Inflate=1)
        assert (plc.state, plc.program["MayPush"]) == ("holding", 0)
        assert plc.run(0.1, AllowSimulatedRig=1).program["MayPush"] == 1

    def test_a_rejected_inflation_is_reported_with_its_reason(self, tutorial):
        plc = Controller(tutorial).run(1.0)
        plc.harness.write_ok({"lease_s": 60.0}, ROBOT)
        plc.run(2.0, Inflate=1)
        assert (plc.program["Pressure.Rejected"], plc.program["Pressure.Reason"]) == (1, LEASE)
        assert (plc.program["MayPush"], plc.state) == (0, "vented")

    def test_the_extended_program_shows_the_fault_and_writes_the_settings(self, tutorial):
        plc = Controller(tutorial, extended=True).run(2.0)
        assert (plc.program["Diagnostics.Valid"], plc.program["Diagnostics.MapMatches"]) == (1, 1)
        snapshot = plc.harness.snapshot()
        assert (snapshot.force_limit_2_n, snapshot.alarm_delay_s) == (4.0, 0.1)
        plc.run(3.0, Inflate=1)
        assert (plc.state, plc.program["MayPush"]) == ("holding", 1)
        plc.run(0.5, RobotMoves=1)
        assert plc.state == "holding"
        assert plc.read_proof_test() == "forbidden"
        plc.line_cut = True
        plc.run(5.0)
        plc.line_cut = False
        plc.run(4.0)
        assert plc.program["Diagnostics.Valid"] == 1
        assert plc.program["Diagnostics.Values.FirstOutFault"] == FAULTS.codes["lease_expired"]


def test_the_extended_program_for_tia_portal_is_the_one_of_the_guide():
    [tia] = [tutorial for tutorial in TUTORIALS if tutorial.fence == "scl"]
    program = EXTENDED_PROGRAM.replace("PROGRAM PneuForce", "FUNCTION_BLOCK PneuForce")
    assert tia.sources()[2] == program.replace("END_PROGRAM", "END_FUNCTION_BLOCK")
