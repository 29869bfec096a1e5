"""Records in their canonical form, the seals that chain them, and what verification makes of altered ones."""

import hashlib
import json
import math

import pytest

from instrument.events.record import GENESIS, Moment, Record, body_of, seal
from instrument.events.verification import Broken, Row, verified
from tests.instrument.events.keeping import a_record

COUNT = 6


def chain(count=COUNT):
    rows, head = [], GENESIS
    for number in range(1, count + 1):
        body = body_of(a_record(number))
        head = seal(head, body)
        rows.append(Row(number, body, head))
    return rows


def test_a_record_says_when_it_was_made_on_both_clocks_to_the_microsecond():
    body = json.loads(body_of(Record(Moment(1_800_000_000_000_007, 12.345678), {"kind": "test"})))
    assert body == {"at": "2027-01-15T08:00:00.000007Z", "mono_s": 12.345678, "kind": "test"}


def test_the_canonical_form_does_not_depend_on_the_order_of_facts():
    at = Moment(0, 0.0)
    assert body_of(Record(at, {"a": 1, "b": 2})) == body_of(Record(at, {"b": 2, "a": 1}))


@pytest.mark.parametrize(("number", "text"), [(math.nan, "nan"), (math.inf, "inf"), (-math.inf, "-inf")])
def test_a_number_that_is_none_is_kept_as_text(number, text):
    body = body_of(Record(Moment(0, 0.0), {"values": {"setpoint_requested_kpa": (number, 8.0)}}))
    assert json.loads(body)["values"] == {"setpoint_requested_kpa": [text, 8.0]}


def test_anyone_can_reckon_a_seal_with_sha_256_alone():
    body = body_of(a_record(1))
    assert seal(GENESIS, body) == hashlib.sha256(bytes(32) + body).digest()


def test_a_whole_chain_is_told_by_its_length_span_and_head():
    rows = chain()
    told = verified(rows)
    assert (told.records, told.head) == (COUNT, rows[-1].seal.hex())
    assert told.first_at < told.last_at


def test_an_empty_log_is_an_unbroken_one():
    assert verified([]).records == 0


@pytest.mark.parametrize("number", range(1, COUNT + 1))
def test_a_changed_record_is_named(number):
    rows = chain()
    forged = rows[number - 1].body.replace(b'"test"', b'"tesT"')
    rows[number - 1] = Row(number, forged, rows[number - 1].seal)
    with pytest.raises(Broken, match=f"^record {number} "):
        verified(rows)


@pytest.mark.parametrize("number", range(1, COUNT + 1))
def test_a_record_that_was_changed_and_sealed_anew_betrays_itself_in_the_next(number):
    rows = chain()
    before = rows[number - 2].seal if number > 1 else GENESIS
    forged = rows[number - 1].body.replace(b'"test"', b'"tesT"')
    rows[number - 1] = Row(number, forged, seal(before, forged))
    if number < COUNT:
        with pytest.raises(Broken, match=f"^record {number + 1} "):
            verified(rows)
    else:
        assert verified(rows).records == COUNT  # only a head that was noted tells


@pytest.mark.parametrize("number", range(1, COUNT))
def test_a_record_that_was_taken_out_is_missed(number):
    rows = chain()
    del rows[number - 1]
    with pytest.raises(Broken, match=f"^record {number} is missing"):
        verified(rows)


@pytest.mark.parametrize("number", range(1, COUNT))
def test_numbering_the_rest_anew_does_not_hide_that_one_was_taken_out(number):
    rows = chain()
    del rows[number - 1]
    renumbered = [row._replace(number=at) for at, row in enumerate(rows, 1)]
    with pytest.raises(Broken, match=f"^record {number} "):
        verified(renumbered)


def test_two_records_that_changed_places_are_found():
    rows = chain()
    rows[2], rows[3] = rows[3]._replace(number=3), rows[2]._replace(number=4)
    with pytest.raises(Broken, match=r"^record 3 "):
        verified(rows)


@pytest.mark.parametrize(
    "row", [Row(None, b"", b""), Row(1, None, None), Row(1, 7, b"x"), Row(1, b"{}", "x")]
)
def test_rows_that_are_no_records_are_found(row):
    with pytest.raises(Broken, match=r"^record 1 "):
        verified([row])


@pytest.mark.parametrize("number", range(COUNT + 1))
def test_a_head_noted_earlier_proves_all_up_to_it(number):
    rows = chain()
    head = rows[number - 1].seal if number else GENESIS
    assert verified(rows, head.hex()).records == COUNT


def test_a_log_that_was_cut_off_or_made_anew_lacks_the_head_that_was_noted():
    noted = chain()[-1].seal.hex()
    for rows in (chain(COUNT - 1), []):
        with pytest.raises(Broken, match="was changed or cut off"):
            verified(rows, noted)
