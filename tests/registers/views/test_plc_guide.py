"""The PLC guide held against the map, and its figures against the serial line's arithmetic."""

import re
import subprocess
from pathlib import Path

import pytest

from instrument.config.sections import Modbus, ModbusRtu
from registers.codes import REFUSALS, STATUS
from registers.field import Wire
from registers.map import BLOCKS, BY_NAME, COMMAND_KEY, REGISTERS
from registers.modbus.bank import Bank
from registers.views import c_header
from registers.views.facts import MEASURED, TEST
from tests.tools import needs

TOP = Path(__file__).parents[3]
GUIDE = (TOP / "docs/plc.md").read_text(encoding="utf-8")


def rows(columns):
    """Cells of each table row that begins with a number or a name and has so many columns."""
    cells = [
        [cell.strip() for cell in line.strip("|").split("|")] for line in GUIDE.splitlines() if "|" in line
    ]
    return [row for row in cells if len(row) == columns]


def test_the_status_bits_that_the_guide_names_are_the_maps():
    told = {int(number): name for number, name in re.findall(r"(\d+) \*(\w+)\*[,:]", GUIDE)}
    assert told.keys() == {6, 15, 21, 31}
    assert told.items() <= {(bit.number, bit.name) for bit in STATUS.bits}


def test_each_refusal_is_named():
    plain = [f"{code} {name.replace('_', ' ')}" for code, name in REFUSALS.names.items() if code]
    assert [name for name in plain if name not in GUIDE] == []


def test_each_notation_of_an_address_is_the_maps():
    told = {row[0]: row[1:] for row in rows(6) if row[0] in BY_NAME}
    assert {"force", "status", "mode", "test_float"} == set(told)
    for name, (wire, number, input_, holding, six) in told.items():
        at = BY_NAME[name].address
        assert wire == f"{at} ({at:04X}h)"
        assert [int(number), int(input_), int(holding)] == [at + 1, 30001 + at, 40001 + at]
        assert six == f"{300001 + at}, {400001 + at}"


@pytest.mark.parametrize(
    ("meaning", "swapped", "turned"),
    [("high word", False, False), ("low word", True, False), ("bytes", False, True)],
)
def test_the_test_words_are_as_the_guide_prints_them(meaning, swapped, turned):
    [printed] = [row[0] for row in rows(2) if meaning in row[1] and re.match("[0-9A-F]{4} ", row[0])]
    bank = Bank(word_swap=swapped)
    data = b"".join(bank.words(r, r.constant) for r in REGISTERS if r.address in TEST)
    words = [data[at : at + 2][:: -1 if turned else 1].hex().upper() for at in range(0, len(data), 2)]
    assert printed.split() == words


WRITTEN = {"mode": 516, "lease": 517, "setpoint_requested_pa": 544, "force_limit_mn": 545, "command_key": 520}


def test_the_writes_and_reads_of_the_guide_are_the_maps():
    for name, address in WRITTEN.items():
        assert BY_NAME[name].address == address
        assert str(address) in GUIDE
    assert f"0–{MEASURED.stop - 1}, **one** request" in GUIDE
    assert ", ".join(f"{first}–{last}" for first, last in BLOCKS) in GUIDE
    assert f"key {COMMAND_KEY:04X}h ({COMMAND_KEY})" in GUIDE


@pytest.mark.parametrize(
    ("name", "unit"), [("setpoint_requested_pa", "Pa"), ("force_limit_mn", "mN"), ("lease", "ms")]
)
def test_the_spans_of_the_guide_are_the_maps(name, unit):
    register = BY_NAME[name]
    assert f"in {unit}, {register.low:.0f}–{register.high:.0f}" in GUIDE


def test_the_settings_of_the_guide_are_the_configurations():
    tcp, rtu = Modbus(), ModbusRtu()
    assert f"Port {tcp.port}, unit id {tcp.unit}" in GUIDE
    assert f"nothing for {tcp.idle_s:.0f} s" in GUIDE
    assert f"whole after {tcp.frame_s:.0f} s" in GUIDE
    assert f"{rtu.baud}, {rtu.parity} parity, {rtu.stop_bits} stop bit" in GUIDE


def exchange_ms(baud, words):
    """Request, answer and two silences; 11 bits to a character (serial line spec V1.02, 2.5.1.1)."""
    silence_s = 1.75e-3 if baud > 19200 else 3.5 * 11 / baud
    return 1e3 * ((8 + 5 + words * Wire.U16.size) * 11 / baud + 2 * silence_s)


def test_a_read_on_a_serial_line_takes_what_the_guide_says():
    [told] = [row[1:] for row in rows(3) if row[0].startswith("request, answer")]
    assert told == [f"{exchange_ms(baud, len(MEASURED)):.0f} ms" for baud in (19200, 115200)]


@needs("gcc")
def test_the_guides_c_compiles(tmp_path):
    [program] = re.findall(r"```c\n(.*?)```", GUIDE, re.DOTALL)
    (tmp_path / "pneuforce_registers.h").write_text(c_header.render())
    (tmp_path / "guide.c").write_text(program)
    strict = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-fsyntax-only"]
    subprocess.run(["gcc", *strict, tmp_path / "guide.c"], check=True)
