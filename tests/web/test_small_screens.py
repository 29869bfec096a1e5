"""Tests of the page on small screens and touch screens: size of the controls, and wide tables."""

import pytest
from PIL import Image

from tests.web.browser import NEEDS_CHROMIUM, NEEDS_PLAYWRIGHT
from tests.web.test_state_bar import BURST, SIZES

pytestmark = [NEEDS_CHROMIUM, NEEDS_PLAYWRIGHT]

MIN_MOUSE_PX, MIN_TOUCH_PX = 24, 44  #: success criteria 2.5.8 and 2.5.5 of WCAG 2.2

#: Show all parts of the page and return [name, width, height] of each control that is smaller than a size.
SMALL_CONTROLS = """((size) => {
  for (const element of document.querySelectorAll("[hidden]")) element.hidden = false;
  for (const element of document.querySelectorAll("details")) element.open = true;
  const controls = "a:not(.skip), button, summary, select, input:not([type=radio]), label:has([type=radio])";
  const visible = [...document.querySelectorAll(controls)].filter((element) => element.checkVisibility());
  return visible.map((element) => {
    const target = element.closest("#bar-fault") ?? element; // the whole alarm is the link
    const { width, height } = target.getBoundingClientRect();
    return [element.id || element.innerText, width, height];
  }).filter(([, width, height]) => Math.min(width, height) < size);
})(%s)"""


@pytest.mark.parametrize(
    ("touch", "min_px"), [(False, MIN_MOUSE_PX), (True, MIN_TOUCH_PX)], ids=["mouse", "touch"]
)
@pytest.mark.parametrize("view", ["", "?view=compact"], ids=["full", "compact"])
def test_each_control_is_large_enough(shown, browser, view, touch, min_px):
    shown.set(state="tripped", faults=[BURST], status=["burst", "failure"], force_n=None)
    shown.open(view, touch=touch)
    browser.wait_for_visible("#bar-fault")
    assert browser.evaluate("matchMedia('(pointer: coarse)').matches") == touch
    for name, size in SIZES.items():
        browser("resize", **size)
        assert (name, browser.evaluate(SMALL_CONTROLS % min_px)) == (name, [])


#: Add empty rows to the table of contacts, show the table at the top edge of the window, and scroll sideways.
SCROLL = """((left) => {
  const table = document.querySelector(".contacts .scroll");
  const rows = table.firstElementChild.createTBody();
  for (let index = 0; index < 10; index++) rows.insertRow().insertCell().textContent = "\u00a0";
  table.scrollIntoView();
  table.scrollLeft = left;
  return table.getBoundingClientRect().toJSON();
})(%s)"""
END = 10_000


def test_a_shadow_shows_that_a_wide_table_continues(shown, browser, tmp_path):
    shown.set()
    shown.open()
    browser.wait_for_text("#bar-state", "holding")
    browser("resize", **SIZES["phone"])
    seen = {}
    for left_px in (0, END):
        box = browser.evaluate(SCROLL % left_px)
        browser("screenshot", path=str(tmp_path / "page.png"))
        image = Image.open(tmp_path / "page.png").convert("L")
        middle_px = box["top"] + box["height"] / 2
        edges = [image.getpixel((round(x), round(middle_px))) for x in (box["left"] + 1, box["right"] - 2)]
        seen[left_px] = [value < 240 for value in edges]
    assert seen == {0: [False, True], END: [True, False]}
