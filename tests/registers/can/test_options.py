"""Tests of the CAN options: range checks and bus load."""

import pytest

from pneuforce.registers.can.frames import FRAMES
from pneuforce.registers.can.options import CanOptions, bus_load
from pneuforce.registers.can.wire import worst_case_bits


@pytest.mark.parametrize(("length", "bits"), [(0, 55), (1, 65), (4, 95), (8, 135)])
def test_the_worst_case_length_is_that_of_the_literature(length, bits):
    assert worst_case_bits(length) == bits


def test_the_default_leaves_nine_tenths_of_the_bus_free():
    assert 0.03 < bus_load(CanOptions()) < 0.1


def test_the_load_counts_every_frame_of_the_node():
    highest = bus_load(CanOptions(force_rate_hz=500))
    assert highest * 500_000 == sum(f.max_rate_hz * worst_case_bits(f.length) for f in FRAMES)


def test_a_load_above_60_percent_raises_an_error():
    with pytest.raises(ValueError, match=r"500 Force .* 125000 bit/s .* 7\d%.* 60%"):
        CanOptions(force_rate_hz=500, bit_rate=125_000)
    CanOptions(force_rate_hz=500, bit_rate=250_000)
    CanOptions(force_rate_hz=300, bit_rate=125_000)


@pytest.mark.parametrize(
    "wrong", [{"node_id": 0}, {"node_id": 128}, {"force_rate_hz": 0}, {"force_rate_hz": 501}]
)
def test_an_option_out_of_range_raises_an_error(wrong):
    with pytest.raises(ValueError, match="1 to"):
        CanOptions(**wrong)
