"""Tests with the Modbus dissector of Wireshark: all answers are decoded as intended, without an error."""

import struct
import subprocess
from dataclasses import replace

import pytest
import serial

from pneuforce.registers.modbus.rtu import encode_frame
from tests.hostile.case import CLOSE, ExpectedEnd, HostileCase, ModbusRequest, Pipelined
from tests.hostile.cases import CASES
from tests.hostile.connection import ServerUnderTest
from tests.hostile.runner import PASS, run_case
from tests.peers.traffic_capture import Transfer, recorded_port, split_answers, tcp_capture, udp_capture
from tests.tools import needs

pytestmark = needs("tshark")

#: Hostile cases in which each request is answered.
ANSWERED = [
    case
    for case in CASES
    if case.steps
    and case.end is ExpectedEnd.OPEN
    and all(isinstance(step, ModbusRequest | Pipelined) for step in case.steps)
]
#: Further requests, which none of the hostile cases contains.
MORE = [
    ModbusRequest("02 0000 0020", ("02 04 .{8}",)),
    ModbusRequest("03 0000 007d", ("03 fa .{500}",)),
    ModbusRequest("04 0200 0022", ("04 44 .{136}",)),
    ModbusRequest("10 0220 0002 04 1b58 0fa0", ("10 0220 0002",)),
    ModbusRequest("17 0220 0002 0220 0001 02 1770", ("17 04 1770 0fa0",)),
    ModbusRequest("11", ("91 01",)),
    *(ModbusRequest(f"2b 0e 0{code} 00", (f"2b 0e 0{code} 83 00 00 .*",)) for code in (1, 2, 3, 4)),
]
BUSY = ModbusRequest("06 0220 1388", ("86 06",))
MIN_ANSWER_BYTES = 5  #: shortest answer on a serial line: an exception
RTU_GROUPS = {"quantities and addresses", "functions", "map", "values"}
#: Options for RTU frames in UDP datagrams. A capture file cannot store the silences between RTU frames.
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
def tcp_transfers(instrument):
    """Send the requests of all cases over TCP. Return all requests and answers."""
    with recorded_port(instrument.port) as (port, transfers):
        server = ServerUnderTest(port=port, answer_timeout_s=10.0, is_pneuforce_server=True)
        cases = [*ANSWERED, HostileCase(group="", name="more", steps=tuple(MORE))]
        assert [o for o in (run_case(case, server) for case in cases) if o.verdict != PASS] == []
        with instrument.leased():
            assert run_case(HostileCase(group="", name="busy", steps=(BUSY,)), server).verdict == PASS
        return list(split_answers(transfers))


def dissected(folder, capture, *options):
    """Return the fields of each answer as tshark decodes them."""
    file = folder / "traffic.pcap"
    file.write_bytes(capture)
    command = ["tshark", "-r", str(file), *options, "-Y", "modbus && ip.src == 10.0.0.1", "-T", "fields"]
    fields = [argument for field in FIELDS for argument in ("-e", field)]
    done = subprocess.run([*command, *fields], capture_output=True, text=True, timeout=60, check=True)
    return [line.split("\t") for line in done.stdout.splitlines()]


def expected_fields(pdu):
    """Return the expected values of FIELDS for an answer. The last two are empty: no error and no warning."""
    function = pdu[0] & 0x7F
    if pdu[0] & 0x80:
        return [str(function), str(pdu[1]), "", "", "", ""]
    size = str(pdu[1]) if function in (2, 3, 4, 23) else ""
    words = (
        struct.unpack(f">{pdu[1] // 2}H", pdu[2:]) if function in (3, 4) else ()
    )  # tshark does not show the words of function 23
    return [str(function), "", size, ",".join(map(str, words)), "", ""]


def test_every_answer_over_tcp_is_decoded_as_intended(tcp_transfers, tmp_path):
    read = dissected(tmp_path, tcp_capture(tcp_transfers))
    expected = [expected_fields(transfer.data[7:]) for transfer in tcp_transfers if transfer.answer]
    assert len(expected) > 1000
    assert [pair for pair in zip(read, expected, strict=True) if pair[0] != pair[1]] == []


def test_the_answers_contain_every_function_and_every_exception(tcp_transfers):
    pdus = [transfer.data[7:] for transfer in tcp_transfers if transfer.answer]
    assert {pdu[0] for pdu in pdus if pdu[0] < 0x80} == {2, 3, 4, 6, 8, 16, 22, 23, 43}
    assert {pdu[1] for pdu in pdus if pdu[0] >= 0x80} == {1, 2, 3, 6, 11}


def test_a_wrong_answer_is_detected(tcp_transfers, tmp_path):
    read = [
        with_wrong_count(transfer) if transfer.answer and transfer.data[7] == 3 else transfer
        for transfer in tcp_transfers
    ]
    expected = [expected_fields(transfer.data[7:]) for transfer in tcp_transfers if transfer.answer]
    lines = dissected(tmp_path, tcp_capture(read))
    pairs = [
        (line, fields)
        for line, fields in zip(lines, expected, strict=True)
        if fields[0] == "3" and not fields[1]
    ]
    assert len(pairs) > 1000
    assert [line for line, fields in pairs if line == fields] == []


def with_wrong_count(transfer):
    """Return the transfer with a byte count that is too large by 2."""
    return replace(transfer, data=transfer.data[:8] + bytes((transfer.data[8] + 2,)) + transfer.data[9:])


def exchange(line, number, pdu):
    """Send a request and return the request and its answer. A correct CRC marks the end of the answer."""
    line.write(encode_frame(1, pdu))
    answer = b""
    while len(answer) < MIN_ANSWER_BYTES or encode_frame(answer[0], answer[1:-2]) != answer:
        more = line.read(1)
        assert more, f"{pdu.hex(' ')} is answered {answer.hex(' ')}"
        answer += more
    return Transfer(number, False, encode_frame(1, pdu)), Transfer(number, True, answer)


@pytest.fixture(scope="module")
def rtu_transfers(instrument):
    """Send valid requests on the serial line. Return requests and answers as one frame each."""
    requests = [
        step for case in ANSWERED if case.group in RTU_GROUPS for step in case.steps if step.unit is None
    ]
    with serial.Serial(instrument.line, 19200, timeout=5.0) as line:
        return [
            transfer
            for number, request in enumerate([*requests, *MORE])
            if CLOSE not in request.legal
            for transfer in exchange(line, number, bytes.fromhex(request.pdu))
        ]


def test_every_answer_on_the_serial_line_is_decoded_as_intended(rtu_transfers, tmp_path):
    read = dissected(tmp_path, udp_capture(rtu_transfers), *AS_RTU)
    expected = [expected_fields(transfer.data[1:-2]) for transfer in rtu_transfers if transfer.answer]
    assert len(expected) > 50
    assert [pair for pair in zip(read, expected, strict=True) if pair[0] != pair[1]] == []


def test_a_wrong_crc_is_detected(rtu_transfers, tmp_path):
    read = [
        replace(transfer, data=transfer.data[:-1] + bytes((transfer.data[-1] ^ 1,)))
        for transfer in rtu_transfers
    ]
    lines = dissected(tmp_path, udp_capture(read), *AS_RTU)
    assert [line for line in lines if not line[5]] == []
