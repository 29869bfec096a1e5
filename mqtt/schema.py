"""Protobuf messages of Sparkplug B, from a table of their fields.

The numbers and types of the fields are those of the Sparkplug specification 3.0, chapter 6.4. Fields that the
instrument neither sends nor reads are missing: a received message may contain them, and they are ignored.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorProto
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message_factory import GetMessageClass

PACKAGE = "org.eclipse.tahu.protobuf"

_UINT32, _UINT64 = FieldDescriptorProto.TYPE_UINT32, FieldDescriptorProto.TYPE_UINT64
_FLOAT, _DOUBLE = FieldDescriptorProto.TYPE_FLOAT, FieldDescriptorProto.TYPE_DOUBLE
_BOOL, _STRING = FieldDescriptorProto.TYPE_BOOL, FieldDescriptorProto.TYPE_STRING


class _Field(NamedTuple):
    name: str
    number: int
    type: FieldDescriptorProto.Type.ValueType | str  #: type of a value, or the name of a message
    repeated: bool = False
    in_value: bool = False  #: at most one of these fields is set


_MESSAGES: Mapping[str, tuple[_Field, ...]] = {
    "Payload": (
        _Field("timestamp", 1, _UINT64),
        _Field("metrics", 2, "Metric", repeated=True),
        _Field("seq", 3, _UINT64),
    ),
    "Metric": (
        _Field("name", 1, _STRING),
        _Field("timestamp", 3, _UINT64),
        _Field("datatype", 4, _UINT32),
        _Field("is_historical", 5, _BOOL),
        _Field("is_null", 7, _BOOL),
        _Field("properties", 9, "PropertySet"),
        _Field("int_value", 10, _UINT32, in_value=True),
        _Field("long_value", 11, _UINT64, in_value=True),
        _Field("float_value", 12, _FLOAT, in_value=True),
        _Field("double_value", 13, _DOUBLE, in_value=True),
        _Field("boolean_value", 14, _BOOL, in_value=True),
        _Field("string_value", 15, _STRING, in_value=True),
    ),
    "PropertySet": (
        _Field("keys", 1, _STRING, repeated=True),
        _Field("values", 2, "PropertyValue", repeated=True),
    ),
    "PropertyValue": (
        _Field("type", 1, _UINT32),
        _Field("double_value", 6, _DOUBLE, in_value=True),
        _Field("string_value", 8, _STRING, in_value=True),
    ),
}


def _file() -> FileDescriptorProto:
    file = FileDescriptorProto(name="pneuforce_sparkplug.proto", package=PACKAGE, syntax="proto2")
    for message_name, fields in _MESSAGES.items():
        message = file.message_type.add(name=message_name)
        if any(field.in_value for field in fields):
            message.oneof_decl.add(name="value")
        for field in fields:
            label = FieldDescriptorProto.LABEL_REPEATED if field.repeated else None
            added = message.field.add(
                name=field.name, number=field.number, label=label or FieldDescriptorProto.LABEL_OPTIONAL
            )
            if isinstance(field.type, str):
                added.type, added.type_name = FieldDescriptorProto.TYPE_MESSAGE, f".{PACKAGE}.{field.type}"
            else:
                added.type = field.type
            if field.in_value:
                added.oneof_index = 0
    return file


_pool = DescriptorPool()  # an own pool, so that a program may also import another definition of Sparkplug
_pool.Add(_file())
PayloadMessage: Any = GetMessageClass(_pool.FindMessageTypeByName(f"{PACKAGE}.Payload"))
