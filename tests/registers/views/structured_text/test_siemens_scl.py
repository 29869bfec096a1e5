"""Tests of the SCL source for TIA Portal: the blocks of the Structured Text library, with marked names."""

import re

import pytest

from pneuforce.registers.views import siemens_scl
from tests.registers.views.structured_text.sources import LIBRARY
from tests.registers.views.structured_text.tutorials import structured_text_of

SCL = siemens_scl.render()
BLOCKS = re.findall(r'^FUNCTION_BLOCK "(\w+)"$', SCL, re.MULTILINE)


def parts_of(text):
    """Return each structure and block of a text, without names of arrays and comments between the parts."""
    text = re.sub(r"^TYPE .*END_TYPE$", "", text, flags=re.MULTILINE)
    return re.findall(r"^(?:TYPE|FUNCTION_BLOCK) .*?^END_(?:TYPE|FUNCTION_BLOCK)$", text, re.M | re.S)


def test_without_the_notation_of_siemens_the_source_is_the_structured_text():
    text = re.sub(r"(SH[LR])\(IN := (.*?), N := (\d+)\)", r"\1(\2, \3)", structured_text_of(SCL))
    text = re.sub(r"(D?WORD)#16#(\d)\b", r"\1#\2", text)
    assert parts_of(text) == parts_of(LIBRARY)
    assert len(parts_of(text)) == len(BLOCKS) + 3
    assert len(BLOCKS) == 6


@pytest.mark.parametrize("block", BLOCKS)
def test_each_local_name_in_a_body_is_marked(block):
    [text] = re.findall(rf'^FUNCTION_BLOCK "{block}"\n(.*?)^END_FUNCTION_BLOCK', SCL, re.M | re.S)
    declarations, body = text.split("BEGIN\n")
    names = set(re.findall(r"^    (\w+) : ", declarations, re.MULTILINE))
    body = re.sub(r"\(\*.*?\*\)|\w+#[\w#]+|\.\w+", " ", body, flags=re.DOTALL)
    unmarked = re.findall(r"(?<![#\w])([A-Za-z_]\w*)(?! :=)\b", body)
    assert set(unmarked) & names == set()
    assert {name for name in names if f"#{name}" in body} == names
    assert not re.findall(r"^ *[A-Za-z]\w* :=", body, re.MULTILINE)


def test_the_source_uses_no_notation_that_scl_lacks():
    assert SCL.isascii()
    assert not re.search(r": TON;|\bD?WORD#\d\b(?!#)|^TYPE \w+ : ARRAY|^TYPE \w", SCL, re.MULTILINE)
    assert len(re.findall(r"\bSH[LR]\(", SCL)) == len(re.findall(r"\bSH[LR]\(IN := ", SCL))
    assert SCL.count("VERSION : 0.1\n") == len(BLOCKS) + 3
