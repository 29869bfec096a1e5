"""Read Device Identification: function 43, MEI type 14."""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum

from registers.modbus.codes import Code

FUNCTION = 0x2B
DEVICE_IDENTIFICATION = 0x0E
_ROOM = 253 - 7  #: bytes for objects in one answer
_LONGEST_TEXT = _ROOM - 2
_INDIVIDUAL = 4


class Object(IntEnum):
    """What the instrument says about itself."""

    VENDOR = 0x00
    PRODUCT_CODE = 0x01
    REVISION = 0x02
    URL = 0x03
    PRODUCT_NAME = 0x04
    MODEL = 0x05
    USER_APPLICATION = 0x06
    SERIAL_NUMBER = 0x80
    CALIBRATION_DATE = 0x81


#: Read code → last object that it reaches.
_LAST = {1: Object.REVISION, 2: 0x7F, 3: 0xFF, _INDIVIDUAL: 0xFF}


class Identity:
    """Object id → text, answered one by one or as a stream."""

    def __init__(self, objects: Mapping[int, str]) -> None:
        """Hold `objects`; a character that is not ASCII becomes "?".

        Raises ValueError where a text is too long for an answer.
        """
        self._objects = {id_: text.encode("ascii", "replace") for id_, text in sorted(objects.items())}
        for id_, text in self._objects.items():
            if len(text) > _LONGEST_TEXT:
                raise ValueError(f"identity object {id_:02X}h is longer than {_LONGEST_TEXT} characters")
        extended = any(id_ >= Object.SERIAL_NUMBER for id_ in self._objects)
        self._conformity = 0x83 if extended else 0x82  # stream and individual access

    def answer(self, pdu: bytes) -> bytes | Code:
        """Answer to one request, or the code that refuses it."""
        if len(pdu) < 2:
            return Code.ILLEGAL_VALUE
        if pdu[1] != DEVICE_IDENTIFICATION:
            return Code.ILLEGAL_FUNCTION
        if len(pdu) != 4 or pdu[2] not in _LAST:
            return Code.ILLEGAL_VALUE
        read_code, first = pdu[2], pdu[3]
        if read_code != _INDIVIDUAL:
            return self._stream(read_code, first)
        if first not in self._objects:
            return Code.ILLEGAL_ADDRESS
        return self._answer(read_code, [first], 0)

    def _stream(self, read_code: int, first: int) -> bytes:
        """As many objects as fit from `first` on, or from the beginning where there is no `first`."""
        reached = [id_ for id_ in self._objects if id_ <= _LAST[read_code]]
        if first in reached:
            reached = reached[reached.index(first) :]
        room = _ROOM
        for count, id_ in enumerate(reached):
            room -= 2 + len(self._objects[id_])
            if room < 0:
                return self._answer(read_code, reached[:count], id_)
        return self._answer(read_code, reached, 0)

    def _answer(self, read_code: int, ids: list[int], following: int) -> bytes:
        """Answer with the objects `ids`; `following` is the one that did not fit, 0 for none."""
        more = 0xFF if following else 0
        head = (FUNCTION, DEVICE_IDENTIFICATION, read_code, self._conformity, more, following, len(ids))
        texts = ((id_, self._objects[id_]) for id_ in ids)
        return bytes(head) + b"".join(bytes((id_, len(text))) + text for id_, text in texts)
