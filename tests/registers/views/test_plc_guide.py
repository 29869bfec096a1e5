"""Tests that the PLC guide agrees with the register map and with the timing of a serial line."""

import re
import subprocess
from pathlib import Path

import pytest

from pneuforce.instrument.config.network_sections import ModbusRtuSection, ModbusSection
from pneuforce.registers.codes import REJECT_REASONS, STATUS
from pneuforce.registers.document_text import MEASURED_BLOCK, TEST_BLOCK
from pneuforce.registers.field import WireType
from pneuforce.registers.map import BLOCKS, BY_NAME, COMMAND_KEY, REGISTERS
from pneuforce.registers.modbus.register_bank import RegisterBank
from pneuforce.registers.views import c_header
from tests.tools import needs

TOP = Path(__file__).parents[3]
GUIDE = (TOP / "docs/plc.md").read_text(encoding="utf-8")


#: Documents with a table of the notations of an address.
NOTATIONS = {"plc.md": GUIDE} | {
    path.name: path.read_text(encoding="utf-8") for path in sorted((TOP / "docs/tutorials").glob("*.md"))
}


def rows(columns, text=GUIDE):
    """Return the cells of each table row with this number of columns."""
    cells = [
        [cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines() if "|" in line
    ]
    return [row for row in cells if len(row) == columns]


def test_the_status_bits_in_the_guide_agree_with_the_map():
    listed = {int(bit): name.strip("`") for bit, name, _ in rows(3) if re.fullmatch(r"`\w+`", name)}
    assert listed.keys() == {6, 15, 21, 31}
    assert listed.items() <= {(bit.number, bit.name) for bit in STATUS.bits}


def test_each_reject_reason_is_named():
    plain = [f"{code} {name.replace('_', ' ')}" for code, name in REJECT_REASONS.names.items() if code]
    assert [name for name in plain if name not in GUIDE] == []


@pytest.mark.parametrize("document", NOTATIONS)
def test_each_notation_of_an_address_agrees_with_the_map(document):
    listed = {row[0]: row[1:] for row in rows(6, NOTATIONS[document]) if row[0] in BY_NAME}
    assert {"force", "mode", "test_float"} <= set(listed)
    for name, (wire, number, input_, holding, six) in listed.items():
        at = BY_NAME[name].address
        assert wire == f"{at} ({at:04X}h)"
        assert [int(number), int(input_), int(holding)] == [at + 1, 30001 + at, 40001 + at]
        assert six == f"{300001 + at}, {400001 + at}"


@pytest.mark.parametrize(
    ("meaning", "swapped", "bytes_swapped"),
    [("high word", False, False), ("low word", True, False), ("bytes", False, True)],
)
def test_the_test_words_in_the_guide_are_correct(meaning, swapped, bytes_swapped):
    [printed] = [row[0] for row in rows(2) if meaning in row[1] and re.match("[0-9A-F]{4} ", row[0])]
    bank = RegisterBank(word_swap=swapped)
    data = b"".join(bank.encode_words(r, r.constant) for r in REGISTERS if r.address in TEST_BLOCK)
    words = [data[at : at + 2][:: -1 if bytes_swapped else 1].hex().upper() for at in range(0, len(data), 2)]
    assert printed.split() == words


WRITTEN = {"mode": 516, "lease": 517, "setpoint_requested_pa": 544, "force_limit_mn": 545, "command_key": 520}


def test_the_addresses_in_the_guide_agree_with_the_map():
    for name, address in WRITTEN.items():
        assert BY_NAME[name].address == address
        assert str(address) in GUIDE
    assert f"0–{MEASURED_BLOCK.stop - 1}, **one** request" in GUIDE
    assert ", ".join(f"{first}–{last}" for first, last in BLOCKS) in GUIDE
    assert f"key {COMMAND_KEY:04X}h ({COMMAND_KEY})" in GUIDE


@pytest.mark.parametrize(
    ("name", "unit"), [("setpoint_requested_pa", "Pa"), ("force_limit_mn", "mN"), ("lease", "ms")]
)
def test_the_ranges_in_the_guide_agree_with_the_map(name, unit):
    register = BY_NAME[name]
    assert f"in {unit}, {register.low:.0f}–{register.high:.0f}" in GUIDE


def test_the_settings_in_the_guide_agree_with_the_configuration():
    tcp, rtu = ModbusSection(), ModbusRtuSection()
    assert f"Port {tcp.port}, unit id {tcp.unit}" in GUIDE
    assert f"idle for {tcp.idle_timeout_s:.0f} s (`idle_timeout_s`)" in GUIDE
    assert f"within {tcp.frame_timeout_s:.0f} s (`frame_timeout_s`)" in GUIDE
    assert f"{rtu.baud}, {rtu.parity} parity, {rtu.stop_bits} stop bit" in GUIDE


def exchange_ms(baud, words):
    """Return the time of a request, its answer and two silences [ms].

    A character has 11 bits (MODBUS over Serial Line V1.02, 2.5.1.1).
    """
    silence_s = 1.75e-3 if baud > 19200 else 3.5 * 11 / baud
    return 1e3 * ((8 + 5 + words * WireType.U16.size) * 11 / baud + 2 * silence_s)


def test_the_time_of_a_read_on_a_serial_line_is_correct():
    [listed] = [row[1:] for row in rows(3) if row[0].startswith("request, answer")]
    assert listed == [f"{exchange_ms(baud, len(MEASURED_BLOCK)):.0f} ms" for baud in (19200, 115200)]


@needs("gcc")
def test_the_c_example_compiles(tmp_path):
    [program] = re.findall(r"```c\n(.*?)```", GUIDE, re.DOTALL)
    (tmp_path / "pneuforce_registers.h").write_text(c_header.render())
    (tmp_path / "guide.c").write_text(program)
    strict = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-fsyntax-only"]
    subprocess.run(["gcc", *strict, tmp_path / "guide.c"], check=True)
