"""The waits before what has failed is tried anew, as CAN and the page have them."""

import pytest

from instrument.cli import page_face
from registers.back_off import BackOff
from registers.can import live


def of(module):
    return BackOff(module.AGAIN_S, module.LONGEST_S, module.WELL_S)


def waits_s(back_off, count):
    for _ in range(count):
        yield back_off.wait_s
        back_off.tried()


@pytest.mark.parametrize(
    ("module", "waits"),
    [(live, [0.1, 0.2, 0.4, 0.8, 1.6, 2.0, 2.0, 2.0]), (page_face, [1, 2, 4, 8, 16, 32, 60, 60])],
    ids=["CAN", "page"],
)
def test_the_waits_double_up_to_the_longest(module, waits):
    assert list(waits_s(of(module), len(waits))) == waits


@pytest.mark.parametrize(("module", "well_s"), [(live, 5.0), (page_face, 60.0)], ids=["CAN", "page"])
def test_what_stayed_well_is_tried_anew_at_once_and_what_fails_soon_is_waited_for_as_before(module, well_s):
    for lived_s, was_well in ((well_s - 0.1, False), (well_s + 0.1, True)):
        back_off = of(module)
        *_, third_s = waits_s(back_off, 3)
        back_off.opened(100.0)
        assert back_off.failed(100.0 + lived_s) is was_well
        assert back_off.wait_s == (module.AGAIN_S if was_well else 2 * third_s)
