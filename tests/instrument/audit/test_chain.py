"""Tests of the hash chain: canonical form of records, digests, and verification of manipulated chains."""

import hashlib
import json
import math

import pytest

from pneuforce.instrument.audit.record import GENESIS, AuditRecord, Timestamp, chain_digest, record_body
from pneuforce.instrument.audit.verification import BrokenChainError, StoredRecord, verify_chain
from tests.instrument.audit.event_log_files import make_record

COUNT = 6


def make_chain(count=COUNT):
    rows, head = [], GENESIS
    for number in range(1, count + 1):
        body = record_body(make_record(number))
        head = chain_digest(head, body)
        rows.append(StoredRecord(number, body, head))
    return rows


def test_a_record_has_both_times_to_the_microsecond():
    body = json.loads(record_body(AuditRecord(Timestamp(1_800_000_000_000_007, 12.345678), {"kind": "test"})))
    assert body == {"at": "2027-01-15T08:00:00.000007Z", "mono_s": 12.345678, "kind": "test"}


def test_the_canonical_form_does_not_depend_on_the_order_of_the_fields():
    at = Timestamp(0, 0.0)
    assert record_body(AuditRecord(at, {"a": 1, "b": 2})) == record_body(AuditRecord(at, {"b": 2, "a": 1}))


@pytest.mark.parametrize(("number", "text"), [(math.nan, "nan"), (math.inf, "inf"), (-math.inf, "-inf")])
def test_nan_and_infinity_are_stored_as_text(number, text):
    body = record_body(AuditRecord(Timestamp(0, 0.0), {"values": {"setpoint_requested_kpa": (number, 8.0)}}))
    assert json.loads(body)["values"] == {"setpoint_requested_kpa": [text, 8.0]}


def test_a_digest_is_sha_256_of_the_previous_digest_and_the_body():
    body = record_body(make_record(1))
    assert chain_digest(GENESIS, body) == hashlib.sha256(bytes(32) + body).digest()


def test_the_verification_returns_length_times_and_head():
    rows = make_chain()
    verified = verify_chain(rows)
    assert (verified.records, verified.head) == (COUNT, rows[-1].digest.hex())
    assert verified.first_at < verified.last_at


def test_an_empty_log_is_unbroken():
    assert verify_chain([]).records == 0


@pytest.mark.parametrize("number", range(1, COUNT + 1))
def test_a_changed_record_is_reported(number):
    rows = make_chain()
    forged = rows[number - 1].body.replace(b'"test"', b'"tesT"')
    rows[number - 1] = StoredRecord(number, forged, rows[number - 1].digest)
    with pytest.raises(BrokenChainError, match=f"^record {number} "):
        verify_chain(rows)


@pytest.mark.parametrize("number", range(1, COUNT + 1))
def test_a_changed_record_with_a_new_digest_is_detected_at_the_next_record(number):
    rows = make_chain()
    before = rows[number - 2].digest if number > 1 else GENESIS
    forged = rows[number - 1].body.replace(b'"test"', b'"tesT"')
    rows[number - 1] = StoredRecord(number, forged, chain_digest(before, forged))
    if number < COUNT:
        with pytest.raises(BrokenChainError, match=f"^record {number + 1} "):
            verify_chain(rows)
    else:
        # A forged last record is detected only by comparison with a head that was noted before.
        assert verify_chain(rows).records == COUNT


@pytest.mark.parametrize("number", range(1, COUNT))
def test_a_removed_record_is_reported(number):
    rows = make_chain()
    del rows[number - 1]
    with pytest.raises(BrokenChainError, match=f"^record {number} is missing"):
        verify_chain(rows)


@pytest.mark.parametrize("number", range(1, COUNT))
def test_new_numbers_do_not_hide_a_removed_record(number):
    rows = make_chain()
    del rows[number - 1]
    renumbered = [row._replace(number=at) for at, row in enumerate(rows, 1)]
    with pytest.raises(BrokenChainError, match=f"^record {number} "):
        verify_chain(renumbered)


def test_two_exchanged_records_are_reported():
    rows = make_chain()
    rows[2], rows[3] = rows[3]._replace(number=3), rows[2]._replace(number=4)
    with pytest.raises(BrokenChainError, match=r"^record 3 "):
        verify_chain(rows)


@pytest.mark.parametrize(
    "row",
    [
        StoredRecord(None, b"", b""),
        StoredRecord(1, None, None),
        StoredRecord(1, 7, b"x"),
        StoredRecord(1, b"{}", "x"),
    ],
)
def test_rows_of_wrong_types_are_reported(row):
    with pytest.raises(BrokenChainError, match=r"^record 1 "):
        verify_chain([row])


@pytest.mark.parametrize("number", range(COUNT + 1))
def test_a_chain_is_verified_against_a_noted_head(number):
    rows = make_chain()
    head = rows[number - 1].digest if number else GENESIS
    assert verify_chain(rows, head.hex()).records == COUNT


def test_a_log_without_the_noted_head_is_broken():
    noted = make_chain()[-1].digest.hex()
    for rows in (make_chain(COUNT - 1), []):
        with pytest.raises(BrokenChainError, match="changed or removed"):
            verify_chain(rows, noted)
