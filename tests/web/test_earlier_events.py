"""Tests of the events that the page shows from before its start."""

import logging

import pytest

from pneuforce.instrument.audit.record import AuditRecord, record_body
from pneuforce.instrument.audit.store import EventLogFile
from pneuforce.web.browser_feed import MAX_EVENTS
from pneuforce.web.earlier_events import earlier_events
from tests.instrument.audit.event_log_files import TIMESTAMP

#: Valid JSON of a count of a count of …, deeper than the recursion limit of Python.
NESTED_COUNT = b'{"kind":"repeated","times":2,"of":' * 990 + b"{}" + b"}" * 990


def write_log(path, *bodies):
    log = EventLogFile(path)
    log.append(bodies)
    log.close()
    return path


def stop(why):
    return record_body(AuditRecord(TIMESTAMP, {"kind": "stop", "why": why}))


def texts(path):
    return [event["text"] for event in earlier_events(path)]


def test_the_latest_records_are_returned_in_words_and_in_order(tmp_path):
    path = write_log(tmp_path / "log", *(stop(f"reason {number}") for number in range(200)))
    assert texts(path) == [f"reason {number}" for number in range(200 - MAX_EVENTS, 200)]
    assert earlier_events(path)[-1] == {
        "at": "2027-01-15T08:00:00.000000Z",
        "kind": "stop",
        "text": "reason 199",
    }


def test_the_log_of_a_running_instrument_is_read(tmp_path):
    log = EventLogFile(tmp_path / "log")
    try:
        for number in range(3):
            log.append([stop(f"reason {number}")])
            assert texts(tmp_path / "log")[-1] == f"reason {number}"
    finally:
        log.close()


@pytest.mark.parametrize("body", [b"[" * 200_000, NESTED_COUNT, b"[1]", b"null", b"{", b""])
def test_a_damaged_record_is_left_out(tmp_path, body):
    assert texts(write_log(tmp_path / "log", stop("before"), body, stop("after"))) == ["before", "after"]


def test_a_log_that_cannot_be_read_gives_no_events_and_one_warning(tmp_path, caplog):
    (tmp_path / "other").write_text("not an event log")
    (tmp_path / "folder").mkdir()
    for name in ("missing", "other", "folder"):
        with caplog.at_level(logging.WARNING):
            assert earlier_events(tmp_path / name) == []
        (record,) = caplog.records
        assert str(tmp_path / name) in record.getMessage()
        caplog.clear()
