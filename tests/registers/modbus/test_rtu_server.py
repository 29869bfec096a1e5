"""Tests of the RTU server on ptys: pymodbus as master, echoing lines, two units, and unplugged cables."""

import asyncio
import os
import select
import termios
import time
import tty
from contextlib import contextmanager, suppress
from itertools import pairwise

import pytest
import serial
from pymodbus.client import ModbusSerialClient
from pymodbus.exceptions import ModbusIOException

from pneuforce.registers.modbus import echo_detector, rtu_port, rtu_server
from pneuforce.registers.modbus.client import ModbusClient, ModbusClientError, SerialPortError
from pneuforce.registers.modbus.rtu import encode_frame
from pneuforce.registers.modbus.rtu_server import ModbusRtuOptions, ModbusRtuServer
from tests.registers.modbus.memory_source import MemorySource
from tests.registers.modbus.rtu_lines import READ, READ_ANSWER, VENT
from tests.registers.modbus.serial_lines import Cable, cable, serving_on
from tests.registers.modbus.serving import IDENTITY, eventually


@pytest.fixture
def source():
    return MemorySource()


@contextmanager
def master(port, **options):
    """Return a serial client of pymodbus with a time-out of 0.5 s."""
    client = ModbusSerialClient(port, parity="N", retries=0, **{"timeout": 0.5} | options)
    assert client.connect()
    try:
        yield client
    finally:
        client.close()


@contextmanager
def pty():
    """Yield the serial port at one end of a pty, and a file object for the other end."""
    far, near = os.openpty()
    tty.setraw(near)
    with os.fdopen(far, "r+b", buffering=0) as raw:
        try:
            yield os.ttyname(near), raw
        finally:
            os.close(near)


def force_of(client, unit=1):
    answer = client.read_input_registers(0, count=2, device_id=unit)
    return client.convert_from_registers(answer.registers, client.DATATYPE.FLOAT32)


def test_pymodbus_reads_writes_and_identifies(source):
    with cable() as line, serving_on(line.ports[0], source), master(line.ports[1]) as client:
        assert force_of(client) == 1.25
        assert len(client.read_holding_registers(0, count=125).registers) == 125
        assert client.read_discrete_inputs(0, count=32).bits[3] is True
        floats = client.DATATYPE.FLOAT32
        assert client.write_registers(512, client.convert_to_registers(8.0, floats)).isError() is False
        assert source.values["setpoint_requested_kpa"] == 8.0
        for mode in (0, 1, 1, 0):
            assert client.write_register(516, mode).isError() is False
        assert source.values["mode"] == "vent"
        assert client.write_registers(512, client.convert_to_registers(12.5, floats)).exception_code == 3
        assert client.read_holding_registers(200).exception_code == 2
        assert client.read_device_information(read_code=3).information[0x80] == b"42"


@pytest.mark.parametrize("parity", ["even", "odd", "none"])
def test_a_client_reaches_the_instrument_over_a_pair_of_ptys_with_any_parity(source, parity):
    with cable() as line, serving_on(line.ports[0], source, parity=parity):
        for _ in range(2):  # repeated, because a pty rejects a parity that is set a second time
            with ModbusClient.connect_serial(line.ports[1], parity=parity) as plc:
                assert plc.read()["force"] == 1.25


@pytest.mark.parametrize(
    ("port", "cause"),
    [("/dev/no-such-port", "no such file or directory"), ("/dev/null", "not a serial port")],
)
def test_the_client_reports_why_its_port_cannot_be_opened(port, cause):
    with pytest.raises(SerialPortError, match=f"{port} cannot be opened: .*{cause}"):
        ModbusClient.connect_serial(port)


def test_a_client_on_the_serial_line_reads_and_writes_as_over_tcp(source):
    with (
        cable() as line,
        serving_on(line.ports[0], source, word_swap=True),
        ModbusClient.connect_serial(line.ports[1], parity="none") as plc,
    ):
        values = plc.read()
        assert (values["force"], values["state"]) == (1.25, "vented")
        plc.write("setpoint_requested", 8.0)
        with pytest.raises(ModbusClientError, match="allowed: 2 … 12 kPa"):
            plc.write("setpoint_requested", 12.5)
    assert source.values["setpoint_requested_kpa"] == 8.0


def test_a_missing_port_is_a_modbus_client_error():
    with pytest.raises(ModbusClientError, match="/dev/no-such-port cannot be opened"):
        ModbusClient.connect_serial("/dev/no-such-port")


def test_a_request_is_answered_soon_after_the_silence(source):
    with pty() as (port, far), serving_on(port, source) as server:
        took_ms = []
        for _ in range(50):
            start_s = time.perf_counter()
            far.write(READ)
            assert far.read(len(READ_ANSWER)) == READ_ANSWER
            took_ms.append(1e3 * (time.perf_counter() - start_s))
        assert 2.0 <= min(took_ms) < 20.0  # a busy machine delays some answers
        assert server.unit.counters.requests == 50


@pytest.mark.parametrize("echoing", [(0,), (0, 1)])
def test_a_line_with_echo_is_served(source, echoing, monkeypatch):
    monkeypatch.setattr(echo_detector, "_ADAPTER_S", 0.4)  # a busy machine can delay the echo
    with (
        cable(2, echoing) as line,
        serving_on(line.ports[0], source) as server,
        master(line.ports[1], handle_local_echo=1 in echoing) as client,
    ):
        for _ in range(3):
            for mode in (0, 0, 1):
                assert client.write_register(516, mode).isError() is False
            assert force_of(client) == 1.25
        assert eventually(lambda: server.unit.counters.echoes == 12)
        assert server.unit.counters.requests == 12
    assert [request["mode"] for request in source.write_requests] == ["vent", "vent", "hold"] * 3


def test_two_units_on_one_line_answer_their_own_requests(source):
    other = MemorySource()
    other.values["force_n"] = 2.5
    with (
        cable(3) as line,
        serving_on(line.ports[0], source, unit=1) as first,
        serving_on(line.ports[1], other, unit=2) as second,
        master(line.ports[2]) as client,
    ):
        for _ in range(10):
            assert (force_of(client, 1), force_of(client, 2)) == (1.25, 2.5)
        assert client.write_register(516, 1, device_id=2).isError() is False
        assert (source.values["mode"], other.values["mode"]) == ("vent", "hold")
        client.write_register(516, 1, device_id=1)
        client.write_register(516, 0, device_id=0, no_response_expected=True)
        assert eventually(lambda: {source.values["mode"], other.values["mode"]} == {"vent"})
        assert force_of(client, 1) == 1.25
        assert (first.unit.counters.requests, second.unit.counters.requests) == (12, 11)
        assert (first.unit.lost_bytes, second.unit.lost_bytes) == (0, 0)


def test_a_port_that_accepts_no_bytes_drops_only_the_answers(source):
    request = encode_frame(1, bytes.fromhex("04 0000 007d"))
    with pty() as (port, far), serving_on(port, source, baud=115200) as server:
        while not server.dropped_answers:
            before = server.unit.counters.requests
            assert before < 1000
            far.write(request)
            assert eventually(lambda before=before: server.unit.counters.requests > before)
        sent = server.unit.counters.requests - server.dropped_answers
        assert len(drained(far)) < sent * len(
            encode_frame(1, bytes((4, 250)) + bytes(250))
        )  # late answers are not sent
        far.write(READ)
        assert far.read(len(READ_ANSWER)) == READ_ANSWER


def drained(far):
    data = b""
    while select.select([far], [], [], 0.1)[0]:
        data += far.read(4096)
    return data


@pytest.mark.parametrize("stop_bits", [1, 2])
def test_the_configured_stop_bits_are_set(source, stop_bits):
    with pty() as (port, far), serving_on(port, source, parity="none", stop_bits=stop_bits):
        flags = termios.tcgetattr(far.fileno())[2]
        assert bool(flags & termios.CSTOPB) == (stop_bits == 2)
        assert termios.tcgetattr(far.fileno())[5] == termios.B19200


@pytest.mark.parametrize(
    ("parity", "letter"),
    [("even", serial.PARITY_EVEN), ("odd", serial.PARITY_ODD), ("none", serial.PARITY_NONE)],
)
def test_the_configured_parity_is_set(source, monkeypatch, parity, letter):
    """A pty has no parity, so the test checks the arguments of pyserial for a port that is not a pty."""
    parities, open_serial = [], serial.Serial

    def record_parity(*arguments, **options):
        parities.append(options["parity"])
        return open_serial(*arguments, **options | {"parity": serial.PARITY_NONE})

    monkeypatch.setattr(serial, "Serial", record_parity)
    monkeypatch.setattr(rtu_port, "_PTY_MAJORS", ())
    with pty() as (port, _), serving_on(port, source, parity=parity):
        assert parities == [letter]


def plugged_in(link, echoing=()):
    """Return a new cable whose first end has the symbolic link `link`."""
    cable = Cable(echoing=echoing)
    link.symlink_to(cable.ports[0])
    return cable


def unplug(cable, link):
    """Unplug the cable. The link is removed first, because the name of the pty may be reused at once."""
    link.unlink()
    cable.unplug()


def logged(caplog):
    return [
        record.getMessage()
        for record in caplog.records
        if record.name == "pneuforce.registers.modbus.rtu_server"
    ]


def answers_on(port):
    def answered():
        with suppress(ModbusIOException):
            return force_of(client) == 1.25

    with master(port, timeout=0.1) as client:
        return eventually(answered, 5.0)


def test_a_port_that_comes_back_under_another_name_is_served_again_within_2_s(source, tmp_path, caplog):
    link = tmp_path / "by-id"
    plugged = plugged_in(link)
    with serving_on(link, source):
        assert answers_on(plugged.ports[1])
        for away_s in (0.0, 0.7):
            unplug(plugged, link)
            time.sleep(away_s)
            plugged = plugged_in(link)
            start_s = time.monotonic()
            assert answers_on(plugged.ports[1])
            assert time.monotonic() < start_s + 2.0
    plugged.unplug()
    # On a starved computer, an incomplete request adds a warning.
    events = [line for line in logged(caplog) if " lost: " in line or " open " in line]
    assert [("hung up" in line, "open again" in line) for line in events] == [
        (True, False),
        (False, True),
    ] * 2
    assert all(str(link) in line for line in events)


def test_no_request_is_carried_out_twice_after_a_change_to_an_adapter_with_echo(source, tmp_path, caplog):
    """The slow line gives the echo 0.1 s instead of 0.03 s, which a busy computer can exceed."""
    link = tmp_path / "by-id"
    plugged = plugged_in(link)
    with serving_on(link, source, baud=1200) as server:
        assert answers_on(plugged.ports[1])
        assert answers_on(plugged.ports[1])
        unplug(plugged, link)
        plugged = plugged_in(link, echoing=(0,))
        assert eventually(lambda: logged(caplog)[-1:] == [f"Modbus RTU: {link} is open again"], 5.0)
        with master(plugged.ports[1], timeout=3.0) as client:
            assert client.write_register(516, 0).isError() is False
        assert eventually(lambda: server.unit.counters.echoes == 1)
    plugged.unplug()
    assert source.write_requests == [{"mode": "vent"}]


def test_a_missing_port_is_tried_twice_a_second_and_logged_once(source, tmp_path, caplog, monkeypatch):
    link, tries, opened = tmp_path / "by-id", [], rtu_server.open_port

    def tried(*settings):
        tries.append(time.monotonic())
        return opened(*settings)

    monkeypatch.setattr(rtu_server, "open_port", tried)
    plugged = plugged_in(link)
    with serving_on(link, source):
        unplug(plugged, link)
        assert eventually(lambda: len(tries) == 4, 10.0)
    assert all(later - earlier > 0.45 for earlier, later in pairwise(tries[1:]))
    assert len(logged(caplog)) == 1


@pytest.mark.parametrize(
    ("port", "cause"),
    [("/dev/no-such-port", "no such file or directory"), ("/dev/null", "not a serial port")],
)
def test_a_port_that_cannot_be_opened_at_the_start_raises_oserror(source, port, cause):
    with pytest.raises(OSError, match=f"{port} cannot be opened: .*{cause}"):
        asyncio.run(ModbusRtuServer(source, ModbusRtuOptions(port=port), IDENTITY).start())


def test_a_port_in_use_raises_oserror(source):
    in_use = pytest.raises(OSError, match=r"/dev/pts/\d+ cannot be opened: another process uses it")
    with cable() as line, serving_on(line.ports[0], source), in_use:
        asyncio.run(ModbusRtuServer(source, ModbusRtuOptions(port=line.ports[0]), IDENTITY).start())


def test_closing_the_server_releases_the_port(source):
    with cable() as line:
        for _ in range(2):
            with serving_on(line.ports[0], source), master(line.ports[1]) as client:
                assert force_of(client) == 1.25


def test_lost_bytes_are_logged_once_a_minute_with_the_settings(source, caplog):
    with pty() as (port, far), serving_on(port, source, baud=9600, parity="none", stop_bits=2):
        for _ in range(5):
            far.write(encode_frame(1, VENT)[:-1])
            time.sleep(0.1)
    [message] = logged(caplog)
    assert message.startswith(f"Modbus RTU on {port}, 9600 8N2: 7 received bytes")
