"""Tests of text for a terminal: control characters are escaped, and all other characters stay."""

import json
import sys

import pytest

from pneuforce.support.printable import printable, printable_json

CONTROL = {
    "C0": range(0x20),
    "DEL and C1": range(0x7F, 0xA0),
    "bidirectional text": [0x061C, 0x200E, 0x200F, *range(0x202A, 0x202F), *range(0x2066, 0x206A)],
    "line separators": [0x85, 0x2028, 0x2029],
    "invisible characters": [0xAD, 0x200B, 0x200D, 0xFEFF, 0xE0041],
    "surrogates": [0xD800, 0xDFFF],
}


@pytest.mark.parametrize("codes", CONTROL.values(), ids=CONTROL)
def test_control_characters_are_escaped(codes):
    for code in codes:
        shown = printable(f"a{chr(code)}b")
        assert shown.isprintable()
        assert shown.startswith("a\\")
        assert shown.endswith("b")


@pytest.mark.parametrize("text", ["", "plain", "ΔP_i = 8,0 kPa → ±2 %", "日本語", "a\\x1b"])
def test_printable_text_is_unchanged(text):
    assert printable(text) == text


def test_chosen_characters_are_kept():
    assert printable("a\nb\x1b", keep="\n") == "a\nb\\x1b"


def test_json_is_printable_and_means_the_same():
    above = range(0x10000, sys.maxunicode + 1, 89)  # a part, because all of them take 12 s
    codes = [*range(0x10000), *above, *CONTROL["invisible characters"]]
    value = {chr(code): chr(code) for code in codes if not chr(code).isprintable()}
    for text in (json.dumps(value, ensure_ascii=False), json.dumps(value)):
        assert printable_json(text).isprintable()
        assert json.loads(printable_json(text)) == value


def test_indented_json_keeps_its_lines():
    text = json.dumps({"a": [1, "\x7f"]}, indent=2)
    assert printable_json(text) == text.replace("\x7f", "\\u007f")
