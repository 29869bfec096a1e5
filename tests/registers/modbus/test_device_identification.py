"""Tests of function 43/14: identification objects, individual and as a stream."""

import pytest

from pneuforce.registers.modbus.device_identification import DeviceIdentification, IdentityObject

OBJECTS = {
    0: "maker",
    1: "code",
    2: "1.0",
    3: "url",
    4: "name",
    5: "model",
    6: "user",
    0x80: "42",
    0x81: "2025-01-31",
}
BASIC = b"\0\5maker\1\4code\2\0031.0"
REGULAR = BASIC + b"\3\3url\4\4name\5\5model\6\4user"
EXTENDED = REGULAR + b"\x80\x0242\x81\x0a2025-01-31"


def answer(read_code, first, objects=OBJECTS):
    return DeviceIdentification(objects).answer(bytes((0x2B, 0x0E, read_code, first)))


@pytest.mark.parametrize(
    ("read_code", "first", "objects", "count"),
    [
        (1, 0, BASIC, 3),
        (2, 0, REGULAR, 7),
        (3, 0, EXTENDED, 9),
        (1, 2, b"\2\0031.0", 1),
        (3, 0x81, b"\x81\x0a2025-01-31", 1),
        (1, 3, BASIC, 3),  # an object outside the category: the answer starts at the first object
        (2, 0x80, REGULAR, 7),
        (3, 0x42, EXTENDED, 9),
        (4, 0x80, b"\x80\x0242", 1),
        (4, 6, b"\6\4user", 1),
    ],
)
def test_objects_are_returned(read_code, first, objects, count):
    assert answer(read_code, first) == bytes((0x2B, 0x0E, read_code, 0x83, 0, 0, count)) + objects


@pytest.mark.parametrize(
    ("request_", "code"),
    [("2b 0e 04 82", 2), ("2b 0e 00 00", 3), ("2b 0e 05 00", 3), ("2b 0e 01", 3), ("2b 0e 01 00 00", 3),
     ("2b", 3), ("2b 0d 01 00", 1), ("2b 0d", 1)],
)  # fmt: skip
def test_other_requests_are_rejected(request_, code):
    assert DeviceIdentification(OBJECTS).answer(bytes.fromhex(request_)) == code


@pytest.mark.parametrize(("last_letters", "expected_answers"), [(40, 2), (41, 3)])
def test_objects_that_do_not_fit_follow_in_the_next_answer(last_letters, expected_answers):
    objects = {0: "a" * 100, 1: "b" * 100, 2: "c" * last_letters, 3: "d" * 244}
    received, first, answers = {}, 0, 0
    while True:
        reply = answer(3, first, objects)
        assert len(reply) <= 253
        answers += 1
        at = 7
        for _ in range(reply[6]):
            received[reply[at]] = reply[at + 2 : at + 2 + reply[at + 1]].decode()
            at += 2 + reply[at + 1]
        assert at == len(reply)
        if not reply[4]:
            break
        assert reply[4] == 0xFF
        first = reply[5]
    assert received == objects
    assert answers == expected_answers


def test_a_text_that_is_too_long_for_an_answer_raises_valueerror():
    with pytest.raises(ValueError, match="05h has 245 characters: at most 244"):
        DeviceIdentification({IdentityObject.MODEL: "x" * 245})


def test_characters_that_are_not_ascii_become_question_marks():
    assert answer(4, 6, {6: "Prüfstand"}) == bytes((0x2B, 0x0E, 4, 0x82, 0, 0, 1)) + b"\6\x09Pr?fstand"
