"""Wireshark's dissector as judge: it reads in every answer what was meant, and finds nothing malformed."""

import struct
import subprocess
from dataclasses import replace

import pytest
import serial

from registers.modbus.rtu import frame
from tests.hostile.case import CLOSE, Ask, Case, End, Together
from tests.hostile.cases import CASES
from tests.hostile.line import Server
from tests.hostile.play import PASS, played
from tests.peers.recording import Said, answers, recording, tcp_capture, udp_capture
from tests.tools import needs

pytestmark = needs("tshark")

#: Cases in which each request gets an answer of its own.
ANSWERED = [
    case
    for case in CASES
    if case.steps and case.end is End.ANSWERS and all(isinstance(step, Ask | Together) for step in case.steps)
]
#: What no hostile case asks for.
MORE = [
    Ask("02 0000 0020", ("02 04 .{8}",)),
    Ask("03 0000 007d", ("03 fa .{500}",)),
    Ask("04 0200 0022", ("04 44 .{136}",)),
    Ask("10 0220 0002 04 1b58 0fa0", ("10 0220 0002",)),
    Ask("17 0220 0002 0220 0001 02 1770", ("17 04 1770 0fa0",)),
    Ask("11", ("91 01",)),
    *(Ask(f"2b 0e 0{code} 00", (f"2b 0e 0{code} 83 00 00 .*",)) for code in (1, 2, 3, 4)),
]
BUSY = Ask("06 0220 1388", ("86 06",))
SHORTEST = 5  #: answer on a serial line: an exception
ON_A_LINE = {"quantities and addresses", "functions", "map", "values"}
#: A frame in a datagram stands for a frame between two silences, for which a capture has no type.
AS_RTU = ("-d", "udp.port==502,mbrtu", "-o", "mbrtu.udp.port:502", "-o", "mbrtu.crc_verification:TRUE")
FIELDS = (
    "modbus.func_code",
    "modbus.exception_code",
    "modbus.byte_cnt",
    "modbus.regval_uint16",
    "_ws.malformed",
    "_ws.expert",
)


@pytest.fixture(scope="module")
def conversations(instrument):
    """All that went to and fro over TCP."""
    with recording(instrument.port) as (port, said):
        server = Server(port=port, patience_s=10.0, ours=True)
        cases = [*ANSWERED, Case(group="", name="more", steps=tuple(MORE))]
        assert [o for o in (played(case, server) for case in cases) if o.verdict != PASS] == []
        with instrument.leased():
            assert played(Case(group="", name="busy", steps=(BUSY,)), server).verdict == PASS
        return list(answers(said))


def dissected(folder, capture, *options):
    """The fields of each answer as tshark reads them."""
    file = folder / "conversation.pcap"
    file.write_bytes(capture)
    command = ["tshark", "-r", str(file), *options, "-Y", "modbus && ip.src == 10.0.0.1", "-T", "fields"]
    fields = [word for field in FIELDS for word in ("-e", field)]
    done = subprocess.run([*command, *fields], capture_output=True, text=True, timeout=60, check=True)
    return [line.split("\t") for line in done.stdout.splitlines()]


def meant(pdu):
    """What tshark is to say of an answer: function, exception, bytes, words; not malformed, no complaint."""
    function = pdu[0] & 0x7F
    if pdu[0] & 0x80:
        return [str(function), str(pdu[1]), "", "", "", ""]
    size = str(pdu[1]) if function in (2, 3, 4, 23) else ""
    words = struct.unpack(f">{pdu[1] // 2}H", pdu[2:]) if function in (3, 4) else ()  # it shows none of 23
    return [str(function), "", size, ",".join(map(str, words)), "", ""]


def test_every_answer_over_tcp_is_what_was_meant(conversations, tmp_path):
    read = dissected(tmp_path, tcp_capture(conversations))
    wanted = [meant(one.data[7:]) for one in conversations if one.answer]
    assert len(wanted) > 1000
    assert [pair for pair in zip(read, wanted, strict=True) if pair[0] != pair[1]] == []


def test_every_function_and_every_exception_was_among_them(conversations):
    pdus = [one.data[7:] for one in conversations if one.answer]
    assert {pdu[0] for pdu in pdus if pdu[0] < 0x80} == {2, 3, 4, 6, 8, 16, 22, 23, 43}
    assert {pdu[1] for pdu in pdus if pdu[0] >= 0x80} == {1, 2, 3, 6, 11}


def test_a_wrong_answer_does_not_pass(conversations, tmp_path):
    read = [spoiled(one) if one.answer and one.data[7] == 3 else one for one in conversations]
    wanted = [meant(one.data[7:]) for one in conversations if one.answer]
    told = dissected(tmp_path, tcp_capture(read))
    pairs = [(line, want) for line, want in zip(told, wanted, strict=True) if want[0] == "3" and not want[1]]
    assert len(pairs) > 1000
    assert [line for line, want in pairs if line == want] == []


def spoiled(said):
    """It counts two bytes more than it has."""
    return replace(said, data=said.data[:8] + bytes((said.data[8] + 2,)) + said.data[9:])


def asked(line, at, pdu):
    """A request and its answer, which ends where its CRC is right."""
    line.write(frame(1, pdu))
    answer = b""
    while len(answer) < SHORTEST or frame(answer[0], answer[1:-2]) != answer:
        more = line.read(1)
        assert more, f"{pdu.hex(' ')} is answered {answer.hex(' ')}"
        answer += more
    return Said(at, False, frame(1, pdu)), Said(at, True, answer)


@pytest.fixture(scope="module")
def on_the_line(instrument):
    """Requests in good form on the serial line, and their answers, frame by frame."""
    asks = [step for case in ANSWERED if case.group in ON_A_LINE for step in case.steps if step.unit is None]
    with serial.Serial(instrument.line, 19200, timeout=5.0) as line:
        return [
            said
            for at, ask in enumerate([*asks, *MORE])
            if CLOSE not in ask.legal
            for said in asked(line, at, bytes.fromhex(ask.pdu))
        ]


def test_every_answer_on_the_line_is_what_was_meant_and_its_crc_is_right(on_the_line, tmp_path):
    read = dissected(tmp_path, udp_capture(on_the_line), *AS_RTU)
    wanted = [meant(one.data[1:-2]) for one in on_the_line if one.answer]
    assert len(wanted) > 50
    assert [pair for pair in zip(read, wanted, strict=True) if pair[0] != pair[1]] == []


def test_a_wrong_crc_does_not_pass(on_the_line, tmp_path):
    read = [replace(one, data=one.data[:-1] + bytes((one.data[-1] ^ 1,))) for one in on_the_line]
    told = dissected(tmp_path, udp_capture(read), *AS_RTU)
    assert [line for line in told if not line[5]] == []
