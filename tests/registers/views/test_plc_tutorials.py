"""Tests that the PLC and Windows tutorials agree with the register map, and that their requests are right."""

import re
import tomllib
from pathlib import Path

import pytest

from pneuforce.instrument import config
from pneuforce.registers.codes import FAULTS, REJECT_REASONS, STATES, STATUS
from pneuforce.registers.document_text import MEASURED_BLOCK, TEST_BLOCK
from pneuforce.registers.map import BLOCKS, BY_NAME, REGISTERS
from pneuforce.registers.modbus.device_identification import DeviceIdentification
from pneuforce.registers.modbus.pdu import RequestHandler
from pneuforce.registers.modbus.register_bank import RegisterBank
from pneuforce.registers.source import Peer
from pneuforce.registers.views import structured_text
from tests.instrument.instrument_harness import PLC, InstrumentHarness
from tests.registers.modbus.serving import IDENTITY

FOLDER = Path(__file__).parents[3] / "docs/tutorials"
TUTORIALS = {path.name: path.read_text(encoding="utf-8") for path in sorted(FOLDER.glob("*.md"))}
#: The names of each kind of number, as pairs of number and name. A number without a kind is a state.
NAMES = {
    "register": {(register.address, register.name) for register in REGISTERS},
    "reject reason": set(REJECT_REASONS.names.items()),
    "fault": set(FAULTS.names.items()),
    "bit": {(bit.number, bit.name) for bit in STATUS.bits},
    "": set(STATES.names.items()),
}
KIND = re.compile(r"(?:\b((?i:register|reject reason|fault|bit)) )?(\d+) \(`([a-z_]+)`\)")
RANGE = re.compile(r"\bregisters? (\d+)(?:–(\d+))?")
each_tutorial = pytest.mark.parametrize("name", TUTORIALS)


@each_tutorial
def test_each_number_with_a_name_agrees_with_the_map(name):
    found = [(kind.lower(), int(number), word) for kind, number, word in KIND.findall(TUTORIALS[name])]
    assert len(found) >= 6
    names = NAMES | {"bit": NAMES["bit"] | {(7, "force_valid")}}
    assert [entry for entry in found if entry[1:] not in names[entry[0]]] == []


@each_tutorial
def test_each_register_number_is_a_register(name):
    starts = {register.address for register in REGISTERS}
    ends = {register.end - 1 for register in REGISTERS}
    for first, last in RANGE.findall(TUTORIALS[name]):
        assert int(first) in starts
        assert not last or int(last) in ends
        assert any(low <= int(first) <= int(last or first) <= high for low, high in BLOCKS)


def test_the_numbers_of_the_modes_of_mb_client_agree_with_the_map():
    """A number such as 40517 is the address plus 40001. An example names the registers that it reads."""
    rows = re.findall(r"^\| \d+ \| \d\d, .* \| (\d+).*: registers? (\d+)", TUTORIALS["tia-portal.md"], re.M)
    assert len(rows) == 7
    for number, address in rows:
        assert int(address) in {int(number), int(number) - 30001, int(number) - 40001}


def test_the_channels_of_codesys_agree_with_the_map():
    text = TUTORIALS["codesys.md"]
    channels = re.findall(r"^\| (\w+) words \| .* 04\) \| (\d+) \| (\d+) \|", text, re.M)
    ranges = {name: range(int(first), int(first) + int(count)) for name, first, count in channels}
    answers = range(BY_NAME["answer_sequence"].address, BY_NAME["answer_result"].end)
    assert ranges == {"measured": MEASURED_BLOCK, "answer": answers, "test": TEST_BLOCK}
    [listed] = re.findall(
        r"one channel for each register: ([\d, ]+); with `PF_Settings` also ([\d, ]+)", text
    )
    pressure, settings = structured_text.render().split("FUNCTION_BLOCK PF_Settings")
    for numbers, block in zip(listed, (pressure, settings), strict=True):
        assert sorted(set(re.findall(r"Address := (\d+);", block))) == sorted(numbers.strip().split(", "))


POWERSHELL = re.findall(r"```powershell\n(.*?)```", TUTORIALS["windows.md"], re.DOTALL)


@pytest.fixture
def instrument():
    """Return a function that answers a frame of Modbus TCP, and the harness of the instrument."""
    harness = InstrumentHarness.holding()
    handler = RequestHandler(RegisterBank(), harness.instrument, DeviceIdentification(IDENTITY))

    def answer(frame):
        length = int.from_bytes(frame[4:6], "big")
        assert (frame[2:4], length, frame[6]) == (b"\0\0", len(frame) - 6, 1)
        pdu = handler.answer(frame[7:], Peer(*PLC), harness.now_s)
        return frame[:4] + (len(pdu) + 1).to_bytes(2, "big") + frame[6:7] + pdu

    return answer, harness


def request_of(script):
    """Return the bytes that a script sends, and the number of bytes that the script reads."""
    [line] = re.findall(r"^\[byte\[\]\]\$request = (.*)$", script, re.MULTILINE)
    [count] = re.findall(r"^\$answer = New-Object byte\[\] (\d+)$", script, re.MULTILINE)
    return bytes.fromhex("".join(re.findall("0x([0-9A-F]{2})", line))), int(count)


def test_the_powershell_script_reads_the_force_and_its_validity(instrument):
    answer, harness = instrument
    script = POWERSHELL[0]
    [positions] = re.findall(r"\$answer\[(\d+)\], \$answer\[(\d+)\]", script)
    [(at, mask)] = re.findall(r"\$answer\[(\d+)\] -band (0x\d+)", script)
    for push_kpa, request in ((1.5, {"mode": "hold"}), (0.0, {"mode": "vent"})):
        harness.push_kpa = push_kpa
        harness.renew(1.0, request=request)
        frame, count = request_of(script)
        received = answer(frame)
        assert len(received) == count
        # BitConverter.ToInt16 takes the low byte first.
        force_mn = int.from_bytes(bytes(received[int(n)] for n in positions), "little", signed=True)
        valid = bool(received[int(at)] & int(mask, 16))
        assert valid == (push_kpa > 0)
        if valid:
            assert force_mn / 1000 == pytest.approx(harness.snapshot().force_n, abs=1e-3)
            assert force_mn > 1000


def test_the_powershell_script_vents(instrument):
    answer, harness = instrument
    assert harness.snapshot().state == "holding"
    frame, count = request_of(POWERSHELL[1])
    received = answer(frame)
    assert (len(received), received[7]) == (count, 6)
    assert re.search(r"\$answer\[7\] -eq 0x06", POWERSHELL[1])
    harness.run(1.0)
    assert harness.snapshot().state == "vented"


def test_the_configuration_in_the_tutorial_is_valid():
    [text] = re.findall(r"```toml\n(.*?)```", TUTORIALS["windows.md"], re.DOTALL)
    parsed = config.parse(tomllib.loads(text), "instrument.toml")
    assert parsed.modbus.port == 5020
    assert all("5020" in tutorial for tutorial in TUTORIALS.values())


def test_the_first_register_of_the_script_is_the_one_that_its_comment_names():
    frame, _ = request_of(POWERSHELL[0])
    first, count = int.from_bytes(frame[8:10], "big"), int.from_bytes(frame[10:12], "big")
    assert first == BY_NAME["force_mn"].address
    assert first + count - 1 == BY_NAME["condensed_status"].address
