"""Tests that the robot guide agrees with the frames, the register map and the bus load check."""

import re
import subprocess
from pathlib import Path

import pytest

from pneuforce.instrument.config.network_sections import CanSection
from pneuforce.registers.can.frames import COMMAND, FRAMES, REJECTED, RESULTS, decode
from pneuforce.registers.can.options import CanOptions, bus_load
from pneuforce.registers.codes import CONDENSED
from pneuforce.registers.map import BY_NAME
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
    assert [(c["mode"], c["setpoint"], c["lease"], c["sequence"]) for c in listed] == [
        ("vent", 0.0, 1.0, 1),
        ("hold", 8.0, 1.0, 2),
        ("hold", 8.0, 1.0, 2),
        ("vent", 0.0, 0.0, 3),
        ("clear_faults", 0.0, 0.0, 4),
        ("vent", 0.0, 0.0, 1),
    ]


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
