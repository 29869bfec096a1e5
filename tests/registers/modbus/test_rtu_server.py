"""The unit on real ports: pymodbus as its master, lines that echo, two units, and cables that are pulled."""

import asyncio
import os
import select
import statistics
import termios
import time
import tty
from contextlib import contextmanager, suppress
from itertools import pairwise

import pytest
import serial
from pymodbus.client import ModbusSerialClient
from pymodbus.exceptions import ModbusIOException

from registers.modbus import line_port, rtu_line
from registers.modbus.client import Plc, PlcError, PortError
from registers.modbus.rtu import frame
from registers.modbus.rtu_line import ModbusRtuLine, Options
from tests.registers.modbus.memory import MemorySource
from tests.registers.modbus.rtu_lines import READ, READ_ANSWER, VENT
from tests.registers.modbus.serial_lines import Cable, cable, serving_on
from tests.registers.modbus.serving import IDENTITY, eventually


@pytest.fixture
def source():
    return MemorySource()


@contextmanager
def master(port, **options):
    """pymodbus's serial client; what it is not answered in half a second is lost."""
    client = ModbusSerialClient(port, parity="N", retries=0, **{"timeout": 0.5} | options)
    assert client.connect()
    try:
        yield client
    finally:
        client.close()


@contextmanager
def pty():
    """A port, and the raw file of whoever is at its far end."""
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
def test_a_plc_reaches_an_instrument_over_a_pair_of_ptys_whatever_its_parity(source, parity):
    with cable() as line, serving_on(line.ports[0], source, parity=parity):
        for _ in range(2):  # a pty refuses a parity from the second time on
            with Plc.on_line(line.ports[1], parity=parity) as plc:
                assert plc.read()["force"] == 1.25


@pytest.mark.parametrize(
    ("port", "why"),
    [("/dev/no-such-port", "no such file or directory"), ("/dev/null", "it is no serial port")],
)
def test_a_plc_is_told_why_its_port_cannot_be_opened(port, why):
    with pytest.raises(PortError, match=f"{port} cannot be opened: .*{why}"):
        Plc.on_line(port)


def test_a_plc_on_the_line_sees_what_one_on_tcp_sees(source):
    with (
        cable() as line,
        serving_on(line.ports[0], source, word_swap=True),
        Plc.on_line(line.ports[1], parity="none") as plc,
    ):
        values = plc.read()
        assert (values["force"], values["state"]) == (1.25, "vented")
        plc.write("setpoint_requested", 8.0)
        with pytest.raises(PlcError, match="allowed: 2 … 12 kPa"):
            plc.write("setpoint_requested", 12.5)
    assert source.values["setpoint_requested_kpa"] == 8.0


def test_a_plc_is_told_that_its_own_port_is_not_there():
    with pytest.raises(PlcError, match="/dev/no-such-port cannot be opened"):
        Plc.on_line("/dev/no-such-port")


def test_a_request_is_answered_soon_after_the_silence(source):
    with pty() as (port, far), serving_on(port, source) as server:
        took_ms = []
        for _ in range(50):
            begun_s = time.perf_counter()
            far.write(READ)
            assert far.read(len(READ_ANSWER)) == READ_ANSWER
            took_ms.append(1e3 * (time.perf_counter() - begun_s))
        assert min(took_ms) >= 2.0
        assert statistics.median(took_ms) < 20.0
        assert server.unit.counters.requests == 50


@pytest.mark.parametrize("echoing", [(0,), (0, 1)])
def test_a_line_on_which_we_hear_ourselves_is_served(source, echoing):
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
    assert [asked["mode"] for asked in source.asked] == ["vent", "vent", "hold"] * 3


def test_two_units_on_one_line_answer_each_for_itself(source):
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


def test_a_port_that_takes_no_bytes_costs_answers_and_nothing_else(source):
    request = frame(1, bytes.fromhex("04 0000 007d"))
    with pty() as (port, far), serving_on(port, source, baud=115200) as server:
        while not server.unsent:
            heard = server.unit.counters.requests
            assert heard < 1000
            far.write(request)
            assert eventually(lambda before=heard: server.unit.counters.requests > before)
        sent = server.unit.counters.requests - server.unsent
        assert len(drained(far)) < sent * len(
            frame(1, bytes((4, 250)) + bytes(250))
        )  # what is late is not sent
        far.write(READ)
        assert far.read(len(READ_ANSWER)) == READ_ANSWER


def drained(far):
    data = b""
    while select.select([far], [], [], 0.1)[0]:
        data += far.read(4096)
    return data


@pytest.mark.parametrize("stop_bits", [1, 2])
def test_the_stop_bits_are_those_that_were_asked_for(source, stop_bits):
    with pty() as (port, far), serving_on(port, source, parity="none", stop_bits=stop_bits):
        flags = termios.tcgetattr(far.fileno())[2]
        assert bool(flags & termios.CSTOPB) == (stop_bits == 2)
        assert termios.tcgetattr(far.fileno())[5] == termios.B19200


@pytest.mark.parametrize(
    ("parity", "letter"),
    [("even", serial.PARITY_EVEN), ("odd", serial.PARITY_ODD), ("none", serial.PARITY_NONE)],
)
def test_the_parity_of_a_line_is_the_one_that_was_asked_for(source, monkeypatch, parity, letter):
    """A pty keeps no parity: seen is what pyserial is asked for, where the port is taken for a line."""
    asked, open_port = [], serial.Serial

    def told(*arguments, **options):
        asked.append(options["parity"])
        return open_port(*arguments, **options | {"parity": serial.PARITY_NONE})

    monkeypatch.setattr(serial, "Serial", told)
    monkeypatch.setattr(line_port, "_PTY_MAJORS", ())
    with pty() as (port, _), serving_on(port, source, parity=parity):
        assert asked == [letter]


def plugged_in(link, echoing=()):
    """A new cable whose first end is found under `link`."""
    fresh = Cable(echoing=echoing)
    link.symlink_to(fresh.ports[0])
    return fresh


def unplug(cable, link):
    """Pull it out; its name goes first, for the pty's own may be another's a moment later."""
    link.unlink()
    cable.unplug()


def told(caplog):
    return [record.getMessage() for record in caplog.records if record.name == "registers.modbus.rtu_line"]


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
            begun_s = time.monotonic()
            assert answers_on(plugged.ports[1])
            assert time.monotonic() < begun_s + 2.0
    plugged.unplug()
    assert told(caplog) == [f"Modbus RTU: {link} is gone: hung up", f"Modbus RTU: {link} is open again"] * 2


def test_an_adapter_that_is_exchanged_for_one_that_hears_itself_has_no_request_carried_out_twice(
    source, tmp_path, caplog
):
    link = tmp_path / "by-id"
    plugged = plugged_in(link)
    with serving_on(link, source) as server:
        assert answers_on(plugged.ports[1])
        assert answers_on(plugged.ports[1])
        unplug(plugged, link)
        plugged = plugged_in(link, echoing=(0,))
        assert eventually(lambda: told(caplog)[-1:] == [f"Modbus RTU: {link} is open again"], 5.0)
        with master(plugged.ports[1], timeout=3.0) as client:
            assert client.write_register(516, 0).isError() is False
        assert eventually(lambda: server.unit.counters.echoes == 1)
    plugged.unplug()
    assert source.asked == [{"mode": "vent"}]


def test_a_port_that_stays_away_is_tried_twice_a_second_and_told_of_once(
    source, tmp_path, caplog, monkeypatch
):
    link, tries, opened = tmp_path / "by-id", [], rtu_line.opened

    def tried(*settings):
        tries.append(time.monotonic())
        return opened(*settings)

    monkeypatch.setattr(rtu_line, "opened", tried)
    plugged = plugged_in(link)
    with serving_on(link, source):
        unplug(plugged, link)
        assert eventually(lambda: len(tries) == 4, 10.0)
    assert all(later - earlier > 0.45 for earlier, later in pairwise(tries[1:]))
    assert len(told(caplog)) == 1


@pytest.mark.parametrize(
    ("port", "why"),
    [("/dev/no-such-port", "no such file or directory"), ("/dev/null", "it is no serial port")],
)
def test_a_port_that_is_not_there_at_the_start_is_told(source, port, why):
    with pytest.raises(OSError, match=f"{port} cannot be opened: .*{why}"):
        asyncio.run(ModbusRtuLine(source, Options(port=port), IDENTITY).start())


def test_a_port_in_use_is_told(source):
    in_use = pytest.raises(OSError, match=r"/dev/pts/\d+ cannot be opened: another process uses it")
    with cable() as line, serving_on(line.ports[0], source), in_use:
        asyncio.run(ModbusRtuLine(source, Options(port=line.ports[0]), IDENTITY).start())


def test_the_port_is_given_back(source):
    with cable() as line:
        for _ in range(2):
            with serving_on(line.ports[0], source), master(line.ports[1]) as client:
                assert force_of(client) == 1.25


def test_bytes_that_make_no_frame_are_told_once_a_minute_with_the_settings(source, caplog):
    with pty() as (port, far), serving_on(port, source, baud=9600, parity="none", stop_bits=2):
        for _ in range(5):
            far.write(frame(1, VENT)[:-1])
            time.sleep(0.1)
    assert told(caplog) == [
        f"Modbus RTU on {port}, 9600 8N2: 7 bytes were in no whole frame; noise, or other settings?"
    ]
