"""Tests of the objects of CiA 404: process values, units, status, filter, and the zero adjustment."""

import math
import struct

import pytest

from pneuforce.registers.can.options import CanOptions
from pneuforce.registers.can.wire import CanFrame
from pneuforce.registers.canopen.abort import AbortCode
from pneuforce.registers.canopen.node import CanopenNode
from pneuforce.registers.canopen.object_dictionary import ENTRIES
from pneuforce.registers.codes import REJECT_REASONS
from tests.instrument.instrument_harness import PLC, InstrumentHarness
from tests.registers.can.fake_source import FakeSource
from tests.registers.canopen.fake_master import IDENTITY, FakeMaster

TYPES = {entry.address: entry.type for entry in ENTRIES}
FORCE, PRESSURE = 1, 2
ZERO = b"zero"
#: Physical units of CiA 303-2.
UNITS = {0x0021_0000: "N", 0x0322_0000: "kPa"}


class Client:
    """SDO client of a node."""

    def __init__(self, node, now_s=lambda: 0.0):
        self.node, self.now_s = node, now_s
        node.tick(now_s())

    def _request(self, head, index, subindex, data=bytes(4)):
        request = struct.pack("<BHB", head, index, subindex) + data
        (answer,) = self.node.receive(CanFrame(0x605, request), self.now_s())
        return answer.data

    def read(self, index, subindex):
        answer = self._request(0x40, index, subindex)
        assert answer[0] & 0xF3 == 0x43
        data_type = TYPES[index, subindex]
        return struct.unpack(data_type.layout, answer[4 : 4 + data_type.size])[0]

    def write(self, index, subindex, data):
        """Write 4 bytes and return the abort code, or 0."""
        answer = self._request(0x23, index, subindex, data)
        return struct.unpack("<I", answer[4:])[0] if answer[0] == 0x80 else 0


def client_of(harness):
    return Client(CanopenNode(harness.instrument, CanOptions(), IDENTITY), lambda: harness.now_s)


def client_with(**values):
    """Return a client of a node whose source has these quantities."""
    return Client(FakeMaster(source=FakeSource(**values)).node)


@pytest.mark.parametrize(
    ("channel", "value", "unit"), [(FORCE, 1.234, "N"), (PRESSURE, 8.765, "kPa")], ids=["force", "pressure"]
)
def test_the_process_values_agree_with_their_unit_and_their_decimal_digits(channel, value, unit):
    client = client_with(force_n=1.234, pressure_kpa=8.765)
    assert UNITS[client.read(0x6131, channel)] == unit
    assert client.read(0x6130, channel) == pytest.approx(value)
    for index in (0x7130, 0x9130):
        assert client.read(index, channel) / 10 ** client.read(0x6132, channel) == pytest.approx(value)


@pytest.mark.parametrize(("value", "code"), [(40.0, 40_000), (-1.0, -1000), (math.nan, 0x7FFF_FFFF)])
def test_the_long_process_value_exceeds_16_bits_and_has_a_not_available_code(value, code):
    assert client_with(pressure_kpa=value).read(0x9130, PRESSURE) == code


@pytest.mark.parametrize(
    ("names", "force_n", "pressure_kpa", "status"),
    [
        (("force_valid",), 1.0, 8.0, (0, 0)),
        (("force_valid", "force_high_alarm"), 6.0, 8.0, (0, 0)),
        (("force_valid",), 20.5, 50.5, (2, 2)),
        ((), -20.5, -5.5, (5, 4)),
        (("overpressure",), math.nan, 26.0, (1, 0)),
        ((), math.nan, math.nan, (1, 1)),
    ],
)
def test_the_status_contains_not_valid_and_both_overloads_but_no_alarm(names, force_n, pressure_kpa, status):
    client = client_with(status=frozenset(names), force_n=force_n, pressure_kpa=pressure_kpa)
    assert tuple(client.read(0x6150, channel) for channel in (FORCE, PRESSURE)) == status


def test_the_overload_bits_follow_the_span():
    source = FakeSource(status=frozenset({"force_valid"}))
    client = Client(FakeMaster(source=source).node)
    for channel, quantity in ((FORCE, "force_n"), (PRESSURE, "pressure_kpa")):
        for index, bit, outward in ((0x6148, 4, -0.1), (0x6149, 2, 0.1)):
            limit = client.read(index, channel)
            source.set(**{quantity: limit})
            assert client.read(0x6150, channel) == 0
            source.set(**{quantity: limit + outward})
            assert client.read(0x6150, channel) == bit


def test_the_filter_constant_is_the_divisor_of_the_pressure_filter():
    """A step of the pressure moves the filtered pressure by 1/n of the step at the first sample."""
    harness = InstrumentHarness.zeroed()
    client = client_of(harness)
    before_kpa = client.read(0x6130, PRESSURE)
    harness.offset_kpa += 1.0
    harness.feed()
    step_kpa = client.read(0x6130, PRESSURE) - before_kpa
    assert client.read(0x61A1, PRESSURE) == 31
    assert 1 / step_kpa == pytest.approx(31, abs=0.6)


def test_autozero_takes_the_zero_of_a_vented_rig():
    harness = InstrumentHarness.zeroed()
    client = client_of(harness)
    assert client.read(0x6124, PRESSURE) == pytest.approx(-0.3, abs=0.01)
    harness.offset_kpa = 0.5
    harness.run(1.5)
    assert client.read(0x6130, PRESSURE) == pytest.approx(0.2, abs=0.01)
    assert client.write(0x6125, PRESSURE, ZERO) == 0
    harness.run(0.1)
    assert client.read(0x6124, PRESSURE) == pytest.approx(-0.5, abs=0.01)
    assert client.read(0x6130, PRESSURE) == pytest.approx(0, abs=0.01)


def test_the_offset_is_not_available_before_the_first_zero_adjustment():
    assert math.isnan(client_of(InstrumentHarness.new().run(0.1)).read(0x6124, PRESSURE))


@pytest.mark.parametrize(("push_kpa", "reason"), [(0.0, "state"), (2.0, "in_contact")])
def test_autozero_of_an_inflated_balloon_is_rejected_with_the_reason_of_the_command(push_kpa, reason):
    harness = InstrumentHarness.holding()
    harness.push_kpa = push_kpa
    harness.run(0.8)
    client = client_of(harness)
    offset_kpa = client.read(0x6124, PRESSURE)
    assert client.write(0x6125, PRESSURE, ZERO) == AbortCode.DEVICE_STATE.code
    assert REJECT_REASONS.names[client.read(0x220E, 0)] == reason
    assert harness.run_command("zero_pressure") == ("failed", reason)
    assert client.read(0x6124, PRESSURE) == offset_kpa


def test_autozero_is_rejected_during_the_lease_of_another_client():
    harness = InstrumentHarness.ready()
    harness.write_ok({"lease_s": 60.0}, PLC)
    client = client_of(harness)
    assert client.write(0x6125, PRESSURE, ZERO) == AbortCode.LOCAL_CONTROL.code
    assert REJECT_REASONS.names[client.read(0x201B, 0)] == "lease"


@pytest.mark.parametrize(("channel", "data"), [(FORCE, ZERO), (PRESSURE, ZERO[::-1]), (PRESSURE, bytes(4))])
def test_a_rejected_autozero_is_logged_with_the_remedy_and_writes_nothing(channel, data):
    source = FakeSource()
    client = Client(FakeMaster(source=source).node)
    assert client.write(0x6125, channel, data) == AbortCode.NOT_STORED.code
    assert source.written == []
    ((written, allowed),) = source.rejected_in_words
    assert f"6125h:{channel}" in written
    assert "6F72657Ah to 6125h:2" in allowed


def test_autozero_uses_a_new_sequence_number_of_the_command_block():
    source = FakeSource(command_sequence=0xFFFF)
    assert Client(FakeMaster(source=source).node).write(0x6125, PRESSURE, ZERO) == 0
    (command,) = source.written
    assert (command["command_code"], command["command_sequence"]) == ("zero_pressure", 0)
