"""What the instrument says about itself, object by object."""

import pytest

from registers.modbus.identity import Identity, Object

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
    return Identity(objects).answer(bytes((0x2B, 0x0E, read_code, first)))


@pytest.mark.parametrize(
    ("read_code", "first", "objects", "count"),
    [
        (1, 0, BASIC, 3),
        (2, 0, REGULAR, 7),
        (3, 0, EXTENDED, 9),
        (1, 2, b"\2\0031.0", 1),
        (3, 0x81, b"\x81\x0a2025-01-31", 1),
        (1, 3, BASIC, 3),  # beyond its category: from the beginning
        (2, 0x80, REGULAR, 7),
        (3, 0x42, EXTENDED, 9),
        (4, 0x80, b"\x80\x0242", 1),
        (4, 6, b"\6\4user", 1),
    ],
)
def test_objects_are_told(read_code, first, objects, count):
    assert answer(read_code, first) == bytes((0x2B, 0x0E, read_code, 0x83, 0, 0, count)) + objects


@pytest.mark.parametrize(
    ("request_", "code"),
    [("2b 0e 04 82", 2), ("2b 0e 00 00", 3), ("2b 0e 05 00", 3), ("2b 0e 01", 3), ("2b 0e 01 00 00", 3),
     ("2b", 3), ("2b 0d 01 00", 1), ("2b 0d", 1)],
)  # fmt: skip
def test_other_requests_are_refused(request_, code):
    assert Identity(OBJECTS).answer(bytes.fromhex(request_)) == code


@pytest.mark.parametrize(("last_letters", "expected_answers"), [(40, 2), (41, 3)])
def test_what_does_not_fit_follows_in_the_next_answer(last_letters, expected_answers):
    objects = {0: "a" * 100, 1: "b" * 100, 2: "c" * last_letters, 3: "d" * 244}
    told, first, answers = {}, 0, 0
    while True:
        reply = answer(3, first, objects)
        assert len(reply) <= 253
        answers += 1
        at = 7
        for _ in range(reply[6]):
            told[reply[at]] = reply[at + 2 : at + 2 + reply[at + 1]].decode()
            at += 2 + reply[at + 1]
        assert at == len(reply)
        if not reply[4]:
            break
        assert reply[4] == 0xFF
        first = reply[5]
    assert told == objects
    assert answers == expected_answers


def test_a_text_that_no_answer_can_hold_is_our_own_mistake():
    with pytest.raises(ValueError, match="05h is longer than 244"):
        Identity({Object.MODEL: "x" * 245})


def test_letters_beyond_ascii_do_no_harm():
    assert answer(4, 6, {6: "Prüfstand"}) == bytes((0x2B, 0x0E, 4, 0x82, 0, 0, 1)) + b"\6\x09Pr?fstand"
