"""Tests of the overview of several instruments: what the page and its data show. Time is an argument."""

from dataclasses import replace
from pathlib import Path

import pytest

from pneuforce.instrument.stream.entry import EntryKind, json_entry
from pneuforce.registers.codes import STATUS
from pneuforce.web.overview.rows import MARKS, page, row
from pneuforce.web.overview.watched_instrument import WatchedInstrument

HOLDING = {
    "state": "holding",
    "status": ["force_valid", "holding"],
    "faults": [],
    "force_n": 1.234,
    "force_std_n": 0.021,
    "pressure_kpa": 8.5,
}


def watched(name="left", web_port=8081, **changes):
    instrument = WatchedInstrument(name, Path("/run/left.sock"), web_port)
    instrument.process(json_entry(EntryKind.HEADER, 0.0, {"serial_number": 7, "version": "0.1.0"}), 0.0)
    instrument.process(json_entry(EntryKind.SNAPSHOT, 0.0, HOLDING | changes), 10.0)
    return instrument


def test_a_valid_force_is_shown_with_its_uncertainty_and_a_link():
    facts = row(watched(), 10.5)
    assert (facts["serial_number"], facts["force_n"], facts["reason"]) == (7, 1.234, None)
    html = page([facts], "host.local")
    assert "<title>1 instrument</title>" in html
    assert "1.23 ± 0.02 N" in html
    assert '<a href="http://host.local:8081/">left</a>' in html
    secured = replace(watched(), web_scheme="https")
    assert '<a href="https://host.local:8081/">left</a>' in page([row(secured, 10.5)], "host.local")


@pytest.mark.parametrize("changes", [{"status": ["holding"]}, {"force_n": None, "status": []}])
def test_a_force_that_is_not_valid_is_never_shown(changes):
    facts = row(watched(**changes), 10.5)
    assert facts["force_n"] is None
    assert "1.23" not in page([facts], "host")


def test_an_old_state_is_no_state():
    assert row(watched(), 11.0)["reachable"]
    facts = row(watched(), 11.01)
    assert facts["reason"] == "the instrument sends nothing"
    assert "1.23" not in page([facts], "host")


def test_faults_are_named_and_counted():
    rows = [row(watched(faults=[5, 99]), 10.0), row(watched("right"), 10.0)]
    html = page(rows, "host")
    assert rows[0]["faults"] == ["burst", "fault 99"]
    assert "<h1>2 instruments, 1 with a latched fault or without data</h1>" in html
    assert html.count('class="bad"') == 3
    assert '<span class="bad">latched fault: burst</span>' in html  # its cause may have gone


def test_a_force_of_zero_has_no_sign():
    html = page([row(watched(force_n=-0.001, pressure_kpa=-0.004), 10.0)], "host")
    assert "0.00 ± 0.02 N" in html
    assert "-0.00" not in html
    assert "-0.01 ± 0.02 N" in page([row(watched(force_n=-0.006), 10.0)], "host")


def test_each_mark_is_a_status_bit_and_is_shown():
    marks = [name for name, _, _ in MARKS]
    assert set(marks) <= {bit.name for bit in STATUS.bits}
    html = page([row(watched(status=marks), 10.0)], "host")
    assert all(text in html for _, text, _ in MARKS)


def test_names_and_reasons_are_escaped():
    instrument = WatchedInstrument("<b>", Path("/x"), None, reason='"<script>"')
    html = page([row(instrument, 0.0)], '"><script>')
    assert "<b>" not in html
    assert "<script>" not in html
    shown = page([row(watched("x", faults=[]), 10.0)], '"><script>')
    assert "<script>" not in shown
