"""The robot guide held against the frames, the map and the load check."""

import re
import subprocess
from pathlib import Path

import pytest

from instrument.config.sections import Can
from registers.can.frames import COMMAND, FRAMES, REFUSED, RESULTS, decode
from registers.can.options import Options, bus_load
from registers.codes import CONDENSED
from registers.map import BY_NAME
from tests.registers.views.cpp_listener import EXAMPLES, STRICT
from tests.tools import needs

TOP = Path(__file__).parents[3]
GUIDE = (TOP / "docs/robot.md").read_text(encoding="utf-8")


def rows(columns):
    """Cells of each table row that has so many columns."""
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in GUIDE.splitlines()]
    return [row for row in cells if len(row) == columns]


def test_each_frame_is_there_with_its_identifiers():
    told = {name: ids for name, ids, *_ in rows(4)}
    for frame in FRAMES:
        assert told[frame.name] == f"{frame.base_id:03X}h + N, {frame.base_id + Can().node_id:03X}h"


def test_each_condition_of_the_condensed_status_is_told():
    told = [name for name, meaning in rows(2) if re.match(r"\d [a-z]", name) and meaning]
    assert told == [f"{bit.number} {bit.name}" for bit in CONDENSED.bits]


def test_each_result_has_what_to_do():
    told = {int(code): name for code, name, what in rows(3) if code.isdecimal() and what}
    refused = [code for code in RESULTS.names if code > REFUSED]
    assert told == {code: name for code, name in RESULTS.names.items() if code < REFUSED}
    assert f"| {refused[0]}–{refused[-1]} | refused_… | {REFUSED} + the code" in GUIDE


COMMANDS = [bytes.fromhex(data) for data in re.findall(r"205#([0-9A-F]+)", GUIDE)]


def test_the_commands_on_the_wire_are_what_the_guide_says():
    told = [decode(COMMAND, data) for data in COMMANDS]
    assert [(c["mode"], c["setpoint"], c["lease"], c["sequence"]) for c in told] == [
        ("vent", 0.0, 1.0, 1),
        ("hold", 8.0, 1.0, 2),
        ("hold", 8.0, 1.0, 2),
        ("vent", 0.0, 0.0, 3),
        ("clear_faults", 0.0, 0.0, 4),
        ("vent", 0.0, 0.0, 1),
    ]


def test_spans_and_settings_are_the_maps_and_the_configurations():
    setpoint, lease = (next(f for f in COMMAND.fields if f.name == name) for name in ("setpoint", "lease"))
    assert f"Pa, {setpoint.low:.0f}–{setpoint.high:.0f}, or 0" in GUIDE
    assert f"0 none, or {lease.low:.0f}–{lease.high:.0f} ms" in GUIDE
    assert BY_NAME["force_limit"].address == 514
    for line in re.search(r"```toml\n\[can\]\n(.*?)```", GUIDE, re.DOTALL)[1].splitlines():
        key, value = line.partition("#")[0].split(" = ")
        assert key == "enabled" or str(getattr(Can(), key)) == value.strip().strip('"')


@pytest.mark.parametrize("row", [row for row in rows(5) if row[0].isdecimal()], ids=lambda row: row[0])
def test_the_load_of_the_bus_is_what_the_check_reckons(row):
    def load(rate_hz):
        try:
            return f"{bus_load(Options(bit_rate=int(row[0]), force_rate_hz=rate_hz)):.0%}".replace("%", " %")
        except ValueError:
            return "refused"

    assert row[1:] == [load(rate_hz) for rate_hz in (50, 100, 200, 500)]


@needs("g++")
def test_the_guides_cpp_compiles_and_backs_off_without_a_frame(tmp_path):
    [function] = re.findall(r"```cpp\n(.*?)```", GUIDE, re.DOTALL)
    silence = "int main() { pneuforce::ForceInput input; return speed(input, nullptr, 0.0) < 0.0 ? 0 : 1; }\n"
    (tmp_path / "guide.cpp").write_text(function + silence)
    program = tmp_path / "guide"
    subprocess.run(["g++", *STRICT, f"-I{EXAMPLES}", "-o", program, tmp_path / "guide.cpp"], check=True)
    subprocess.run([program], check=True)
