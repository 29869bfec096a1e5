"""Tests that the robot guide agrees with the frames, the register map and the bus load check."""

import re
import subprocess
from pathlib import Path

import pytest

from pneuforce.instrument.config.network_sections import CanSection
from pneuforce.registers.can.frames import ANSWER, COMMAND, COMMAND_MODES, FRAMES, REJECTED, RESULTS, decode
from pneuforce.registers.can.node import CanNode
from pneuforce.registers.can.options import CanOptions, bus_load
from pneuforce.registers.can.wire import CanFrame
from pneuforce.registers.codes import CONDENSED, REJECT_REASONS
from pneuforce.registers.field import WireType
from pneuforce.registers.map import BY_NAME
from tests.instrument.instrument_harness import PLC, ROBOT, InstrumentHarness
from tests.registers.views.cpp_listener import EXAMPLES, STRICT
from tests.tools import needs

TOP = Path(__file__).parents[3]
GUIDE = (TOP / "docs/robot.md").read_text(encoding="utf-8")


def rows(columns):
    """Return the cells of each table row with this number of columns."""
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in GUIDE.splitlines()]
    return [row for row in cells if len(row) == columns]


def test_each_frame_is_listed_with_its_identifiers():
    listed = {name: ids for name, ids, *_ in rows(4)}
    for frame in FRAMES:
        assert listed[frame.name] == f"{frame.base_id:03X}h + N, {frame.base_id + CanSection().node_id:03X}h"


def test_each_bit_of_the_condensed_status_is_listed():
    listed = [name for name, meaning in rows(2) if re.match(r"\d [a-z]", name) and meaning]
    assert listed == [f"{bit.number} {bit.name}" for bit in CONDENSED.bits]


def test_each_result_has_a_remedy():
    listed = {int(code): name for code, name, what in rows(3) if code.isdecimal() and what}
    rejected = [code for code in RESULTS.names if code > REJECTED]
    assert listed == {code: name for code, name in RESULTS.names.items() if code < REJECTED}
    assert f"| {rejected[0]}–{rejected[-1]} | rejected_… | {REJECTED} + the code" in GUIDE


COMMANDS = [bytes.fromhex(data) for data in re.findall(r"205#([0-9A-F]+)", GUIDE)]


def test_the_example_commands_have_the_described_content():
    listed = [decode(COMMAND, data) for data in COMMANDS]
    names = ("mode", "setpoint", "lease", "sequence", "proof_test")
    assert [tuple(command[name] for name in names) for command in listed] == [
        ("lease", 0.0, 1.0, 1, "allowed"),
        ("vent", 0.0, 1.0, 2, "allowed"),
        ("hold", 8.0, 1.0, 3, "allowed"),
        ("hold", 8.0, 1.0, 3, "forbidden"),
        ("lease", 0.0, 1.0, 4, "allowed"),
        ("vent", 0.0, 0.0, 5, "allowed"),
        ("clear_faults", 0.0, 0.0, 6, "allowed"),
        ("vent", 0.0, 0.0, 1, "allowed"),
    ]


def test_the_fields_of_the_command_are_listed_with_their_bytes_and_modes():
    types = {WireType.U16: "uint16", WireType.U8: "uint8"}
    listed = [row[:3] for row in rows(4) if row[1] in types.values()]
    assert listed == [
        [
            f"{offset}–{offset + 1}" if field.wire is WireType.U16 else str(offset),
            types[field.wire],
            field.name,
        ]
        for offset, field in COMMAND.field_offsets
    ]
    [modes] = re.findall(r"^\| 2 \| uint8 \| mode \| (.*) \|$", GUIDE, re.MULTILINE)
    assert [int(mode.split()[0]) for mode in modes.split(", ")] == list(COMMAND_MODES.names)
    assert f"result {REJECTED + REJECT_REASONS.codes['lease']}, a client on another bus" in GUIDE


class Robot:
    """Node on the CAN bus of an instrument with a simulated rig, in virtual time."""

    def __init__(self, harness):
        self.harness = harness
        self._node = CanNode(harness.instrument, CanOptions())

    def send(self, data):
        """Send a Command. Return its result, and the mode, the holder and the permission of proof tests."""
        [answer] = self._node.receive(CanFrame(0x205, data), self.harness.now_s)
        self.harness.run(0.3)
        snapshot = self.harness.snapshot(ROBOT)
        return (
            decode(ANSWER, answer.data)["result"],
            snapshot.mode,
            snapshot.lease_holder,
            snapshot.proof_test,
        )


def test_the_example_commands_hold_the_balloon_and_forbid_proof_tests_until_the_vent():
    robot = Robot(InstrumentHarness.ready())
    lease, vent, hold, hold_without_tests, renew, end = COMMANDS[:6]
    assert robot.send(lease) == ("accepted", "vent", "can", "allowed")
    assert robot.send(vent) == ("accepted", "vent", "can", "allowed")
    assert robot.send(hold_without_tests) == ("accepted", "hold", "can", "forbidden")
    assert [robot.send(renew) for _ in range(5)] == 5 * [("accepted", "hold", "can", "forbidden")]
    assert robot.send(end) == ("accepted", "vent", "none", "allowed")
    assert robot.send(lease)[0] == "accepted"
    assert robot.send(hold[:3] + bytes((9,)) + hold[4:]) == ("accepted", "hold", "can", "allowed")


def test_while_another_bus_has_the_lease_the_first_step_is_rejected_and_changes_nothing():
    harness = InstrumentHarness.ready()
    harness.write_ok({"lease_s": 60.0, "mode": "hold", "setpoint_requested_kpa": 6.0}, PLC)
    assert Robot(harness).send(COMMANDS[0]) == ("rejected_lease", "hold", PLC[0], "allowed")


def test_ranges_and_settings_agree_with_the_map_and_the_configuration():
    setpoint, lease = (next(f for f in COMMAND.fields if f.name == name) for name in ("setpoint", "lease"))
    assert f"Pa, {setpoint.low:.0f}–{setpoint.high:.0f}, or 0" in GUIDE
    assert f"0 none, or {lease.low:.0f}–{lease.high:.0f} ms" in GUIDE
    assert BY_NAME["force_limit"].address == 514
    for line in re.search(r"```toml\n\[can\]\n(.*?)```", GUIDE, re.DOTALL)[1].splitlines():
        key, value = line.partition("#")[0].split(" = ")
        assert key == "enabled" or str(getattr(CanSection(), key)) == value.strip().strip('"')


@pytest.mark.parametrize("row", [row for row in rows(5) if row[0].isdecimal()], ids=lambda row: row[0])
def test_the_bus_load_agrees_with_the_load_check(row):
    def load(rate_hz):
        try:
            return f"{bus_load(CanOptions(bit_rate=int(row[0]), force_rate_hz=rate_hz)):.0%}".replace(
                "%", " %"
            )
        except ValueError:
            return "refused"

    assert row[1:] == [load(rate_hz) for rate_hz in (50, 100, 200, 500)]


@needs("g++")
def test_the_cpp_example_compiles_and_backs_off_without_a_frame(tmp_path):
    [function] = re.findall(r"```cpp\n(.*?)```", GUIDE, re.DOTALL)
    main = "int main() { pneuforce::ForceInput input; return speed(input, nullptr, 0.0) < 0.0 ? 0 : 1; }\n"
    (tmp_path / "guide.cpp").write_text(function + main)
    program = tmp_path / "guide"
    subprocess.run(["g++", *STRICT, f"-I{EXAMPLES}", "-o", program, tmp_path / "guide.cpp"], check=True)
    subprocess.run([program], check=True)
