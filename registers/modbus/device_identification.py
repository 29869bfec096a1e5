"""Read Device Identification: Modbus function 43, MEI type 14."""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum

from pneuforce.registers.modbus.exception_codes import ExceptionCode

FUNCTION = 0x2B
DEVICE_IDENTIFICATION = 0x0E
_MAX_OBJECT_BYTES = 253 - 7  #: bytes for objects in one answer
_MAX_TEXT_LENGTH = _MAX_OBJECT_BYTES - 2
_INDIVIDUAL = 4


class IdentityObject(IntEnum):
    """Ids of the objects that identify the instrument."""

    VENDOR = 0x00
    PRODUCT_CODE = 0x01
    REVISION = 0x02
    URL = 0x03
    PRODUCT_NAME = 0x04
    MODEL = 0x05
    USER_APPLICATION = 0x06
    SERIAL_NUMBER = 0x80
    CALIBRATION_DATE = 0x81


#: Read code → id of the last object that may be read with it.
_LAST_OBJECT = {1: IdentityObject.REVISION, 2: 0x7F, 3: 0xFF, _INDIVIDUAL: 0xFF}


class DeviceIdentification:
    """Identification objects (id → text) for individual access and stream access."""

    def __init__(self, objects: Mapping[int, str]) -> None:
        """Store `objects`. A character that is not ASCII becomes "?".

        Raises ValueError if a text is too long for one answer.
        """
        self._objects = {id_: text.encode("ascii", "replace") for id_, text in sorted(objects.items())}
        for id_, text in self._objects.items():
            if len(text) > _MAX_TEXT_LENGTH:
                raise ValueError(
                    f"identity object {id_:02X}h has {len(text)} characters: "
                    f"at most {_MAX_TEXT_LENGTH} are allowed"
                )
        extended = any(id_ >= IdentityObject.SERIAL_NUMBER for id_ in self._objects)
        self._conformity = 0x83 if extended else 0x82  # both codes: stream access and individual access

    def answer(self, pdu: bytes) -> bytes | ExceptionCode:
        """Return the answer PDU to the request `pdu`, or an exception code."""
        if len(pdu) < 2:
            return ExceptionCode.ILLEGAL_VALUE
        if pdu[1] != DEVICE_IDENTIFICATION:
            return ExceptionCode.ILLEGAL_FUNCTION
        if len(pdu) != 4 or pdu[2] not in _LAST_OBJECT:
            return ExceptionCode.ILLEGAL_VALUE
        read_code, first = pdu[2], pdu[3]
        if read_code != _INDIVIDUAL:
            return self._stream(read_code, first)
        if first not in self._objects:
            return ExceptionCode.ILLEGAL_ADDRESS
        return self._encode(read_code, [first], 0)

    def _stream(self, read_code: int, first: int) -> bytes:
        """Return as many objects as fit, from object `first`. If it is missing, start at the lowest id."""
        ids = [id_ for id_ in self._objects if id_ <= _LAST_OBJECT[read_code]]
        if first in ids:
            ids = ids[ids.index(first) :]
        free_bytes = _MAX_OBJECT_BYTES
        for count, id_ in enumerate(ids):
            free_bytes -= 2 + len(self._objects[id_])
            if free_bytes < 0:
                return self._encode(read_code, ids[:count], id_)
        return self._encode(read_code, ids, 0)

    def _encode(self, read_code: int, ids: list[int], next_id: int) -> bytes:
        """Return an answer with the objects `ids`. `next_id` is the first object that did not fit, or 0."""
        more_follows = 0xFF if next_id else 0
        head = (FUNCTION, DEVICE_IDENTIFICATION, read_code, self._conformity, more_follows, next_id, len(ids))
        texts = ((id_, self._objects[id_]) for id_ in ids)
        return bytes(head) + b"".join(bytes((id_, len(text))) + text for id_, text in texts)
