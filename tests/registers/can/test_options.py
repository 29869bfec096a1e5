import pytest

from registers.can.frames import FRAMES
from registers.can.options import Options, bus_load
from registers.can.wire import longest_bits


@pytest.mark.parametrize(("length", "bits"), [(0, 55), (1, 65), (4, 95), (8, 135)])
def test_a_frame_takes_as_many_bits_as_the_textbook_says(length, bits):
    assert longest_bits(length) == bits


def test_the_default_leaves_nine_tenths_of_the_bus_free():
    assert 0.03 < bus_load(Options()) < 0.1


def test_the_load_counts_every_frame_of_the_node():
    highest = bus_load(Options(force_rate_hz=500))
    assert highest * 500_000 == sum(f.most_per_s * longest_bits(f.length) for f in FRAMES)


def test_a_load_beyond_sixty_percent_is_refused_in_a_sentence():
    with pytest.raises(ValueError, match=r"500 Force frames .* 125000 bit/s by 7\d%; at most 60% is allowed"):
        Options(force_rate_hz=500, bit_rate=125_000)
    Options(force_rate_hz=500, bit_rate=250_000)
    Options(force_rate_hz=300, bit_rate=125_000)


@pytest.mark.parametrize(
    "wrong", [{"node_id": 0}, {"node_id": 128}, {"force_rate_hz": 0}, {"force_rate_hz": 501}]
)
def test_an_option_out_of_its_span_is_refused(wrong):
    with pytest.raises(ValueError, match="must be 1 to"):
        Options(**wrong)
