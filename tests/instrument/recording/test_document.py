"""Tests that docs/recordings.md lists the columns and the codes of a recording."""

import re
from pathlib import Path

import pytest

from pneuforce.instrument.measurement.measurement import Quality
from pneuforce.instrument.recording.contact_table import CONTACT_TYPES
from pneuforce.instrument.stream.sample_record import SampleRecord
from pneuforce.protocol.frames import BoardState

DOCUMENT = (Path(__file__).parents[3] / "docs/recordings.md").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("sentence", "codes"),
    [
        ("The codes of the state are:", BoardState),
        ("sum of the codes that apply:", [flag for flag in Quality if flag]),
    ],
)
def test_the_document_lists_all_codes(sentence, codes):
    listed = re.search(sentence + "(.*?)[.|]", DOCUMENT)[1].strip()
    assert listed.split(", ") == [f"{code.value} {code.name.lower().replace('_', ' ')}" for code in codes]


@pytest.mark.parametrize(
    ("heading", "columns"),
    [
        ("| column of `samples` | meaning |", SampleRecord._fields),
        ("**One row per contact.**", CONTACT_TYPES),
    ],
)
def test_the_document_lists_all_columns(heading, columns):
    table = re.search(r"^\| ---(?:.+\n)+", DOCUMENT.partition(heading)[2], re.MULTILINE)[0]
    listed = [name for row in table.splitlines() for name in re.findall(r"`(\w+)`", row.split("|")[1])]
    assert sorted(listed) == sorted(columns)
