"""Conversion of objects to JSON values and back. The declared types of the fields determine the conversion.

A JSON value contains names of fields and of members of enumerations, but no names of classes. It therefore
cannot select the code that runs. A value that does not have exactly the declared type is rejected.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import MISSING, Field, fields, is_dataclass
from enum import Enum, Flag
from functools import cache
from types import UnionType
from typing import Any, Literal, NamedTuple, get_args, get_origin, get_type_hints

from pneuforce.instrument.stream.entry import StreamError

MAX_ITEMS = 1000  #: largest number of elements in a container; the instrument uses at most 256
MAX_INTEGER = 2**63


class Codec(NamedTuple):
    """Conversions of one declared type. `decode` raises StreamError if a JSON value has another type."""

    encode: Callable[[Any], Any]
    decode: Callable[[Any], Any]


@cache
def codec_of(declared: Any, finite: bool = False) -> Codec:
    """Return the conversions of a declared type. With `finite`, NaN and infinities are rejected.

    Supported are plain values, enumerations, `X | None`, `Literal`, list, set, dict and tuple, dataclasses
    and named tuples. A frozen dataclass contains parameters or a message, so its numbers must be finite. Only
    a field whose default is infinite, for example a range without limits, may be infinite.

    Raises TypeError for another type.
    """
    origin = get_origin(declared)
    if origin in _CONTAINERS:
        return _CONTAINERS[origin](*(codec_of(part, finite) for part in get_args(declared)))
    if origin is Literal:
        return Codec(str, _member_of(get_args(declared)))
    if origin is UnionType:
        (part,) = (codec_of(part, finite) for part in get_args(declared) if part is not type(None))
        return _optional(part)
    if declared is float:
        return _FINITE if finite else _FLOAT
    if declared in _PLAIN:
        return _PLAIN[declared]
    if isinstance(declared, type) and issubclass(declared, Flag):
        return Codec(lambda value: value.value, _flag_of(declared))
    if isinstance(declared, type) and issubclass(declared, Enum):
        name_of = _member_of(tuple(declared.__members__))
        return Codec(lambda value: value.name, lambda document: declared[name_of(document)])
    if is_dataclass(declared) or hasattr(declared, "_fields"):
        return _record(declared, finite)
    raise TypeError(f"a checkpoint cannot contain the type {declared}")


# ---- plain values


def _checked(kind: type, allowed: Callable[[Any], bool] = lambda _: True) -> Callable[[Any], Any]:
    def decode(document: Any) -> Any:
        if type(document) is kind and allowed(document):
            return document
        raise _rejected(document)

    return decode


def _rejected(document: Any) -> StreamError:
    """Return the error for a value. Only the type of a container is named, because it can be large."""
    is_container = isinstance(document, list | dict)
    return StreamError(f"invalid value {type(document).__name__ if is_container else repr(document)[:40]}")


def _member_of(names: tuple[str, ...]) -> Callable[[Any], Any]:
    return _checked(str, names.__contains__)


def _decode_bytes(document: Any) -> bytearray:
    try:
        return bytearray.fromhex(_TEXT.decode(document))
    except ValueError:
        raise _rejected(document) from None


def _flag_of(declared: type[Flag]) -> Callable[[Any], Any]:
    mask = sum(member.value for member in declared)
    decode_mask = _checked(int, lambda value: 0 <= value <= mask)
    return lambda document: declared(decode_mask(document))


_FLOAT, _FINITE = Codec(float, _checked(float)), Codec(float, _checked(float, math.isfinite))
_TEXT = Codec(str, _checked(str, str.isprintable))
_PLAIN: Mapping[type, Codec] = {
    bool: Codec(bool, _checked(bool)),
    int: Codec(int, _checked(int, lambda value: -MAX_INTEGER <= value < MAX_INTEGER)),
    str: _TEXT,
    bytearray: Codec(bytearray.hex, _decode_bytes),
}


# ---- containers


def _optional(part: Codec) -> Codec:
    return Codec(
        lambda value: None if value is None else part.encode(value),
        lambda document: None if document is None else part.decode(document),
    )


def _items(document: Any, length: int | None = None) -> list[Any]:
    """Return the elements of a JSON list. `length` is the required number of elements."""
    if type(document) is list and len(document) <= MAX_ITEMS and length in (None, len(document)):
        return document
    raise _rejected(document)


def _list(part: Codec) -> Codec:
    encode, decode = part
    return Codec(
        lambda values: [encode(value) for value in values],
        lambda document: [decode(item) for item in _items(document)],
    )


def _set(part: Codec) -> Codec:
    items = _list(part)
    return Codec(lambda values: items.encode(sorted(values)), lambda document: set(items.decode(document)))


def _tuple(*parts: Codec) -> Codec:
    def encode(values: Any) -> list[Any]:
        return [part.encode(value) for part, value in zip(parts, values, strict=True)]

    def decode(document: Any) -> tuple[Any, ...]:
        items = _items(document, len(parts))
        return tuple(part.decode(item) for part, item in zip(parts, items, strict=True))

    return Codec(encode, decode)


def _dict(key: Codec, value: Codec) -> Codec:
    """Return the codec of a dictionary: a list of pairs, because a key in JSON must be a text."""
    pairs = _list(_tuple(key, value))

    def decode(document: Any) -> dict[Any, Any]:
        decoded = dict(pairs.decode(document))
        if len(decoded) != len(document):
            raise StreamError("a key occurs twice")
        return decoded

    return Codec(lambda values: pairs.encode(values.items()), decode)


_CONTAINERS: Mapping[Any, Callable[..., Codec]] = {list: _list, set: _set, tuple: _tuple, dict: _dict}


# ---- records


def _record(declared: Any, finite: bool) -> Codec:
    """Return the codec of a dataclass or a named tuple: a JSON object with exactly its fields."""
    if is_dataclass(declared):
        finite = finite or _is_frozen(declared)
        names = [field.name for field in fields(declared) if _is_state(field)]
        make = _maker_of(declared)
    else:
        names, make = declared._fields, lambda values: declared(**values)
    hints = get_type_hints(declared)
    unlimited = {name for name, default in _defaults(declared).items() if _is_infinite(default)}
    codecs = {name: codec_of(hints[name], finite and name not in unlimited) for name in names}
    encoders = [(name, codec.encode) for name, codec in codecs.items()]

    def encode(value: Any) -> dict[str, Any]:
        return {name: encode_field(getattr(value, name)) for name, encode_field in encoders}

    def decode(document: Any) -> Any:
        if type(document) is not dict or document.keys() != codecs.keys():
            raise StreamError(f"the fields are not those of {declared.__name__}")
        return make({name: _decode_field(name, codec, document[name]) for name, codec in codecs.items()})

    return Codec(encode, decode)


def _decode_field(name: str, codec: Codec, document: Any) -> Any:
    try:
        return codec.decode(document)
    except StreamError as error:
        raise StreamError(f"{name}: {error}") from None


def _defaults(declared: Any) -> Mapping[str, Any]:
    if is_dataclass(declared):
        return {field.name: field.default for field in fields(declared)}
    return dict(declared._field_defaults)


def _is_infinite(default: Any) -> bool:
    """Return True for a default value that is infinite, or contains an infinite limit of a range."""
    return any(type(part) is float and math.isinf(part) for part in _parts(default))


def _parts(default: Any) -> tuple[Any, ...]:
    return default if isinstance(default, tuple) else (default,)


def _is_frozen(declared: Any) -> bool:
    return bool(declared.__dataclass_params__.frozen)


def _is_state(field: Field[Any]) -> bool:
    return bool(field.metadata.get("state", True))


def _maker_of(declared: Any) -> Callable[[Mapping[str, Any]], Any]:
    """Return a function that creates an object of a dataclass from its state. No constructor is called.

    A field that is not a part of the state gets its default value.
    """

    def make(values: Mapping[str, Any]) -> Any:
        new = object.__new__(declared)
        for field in fields(declared):
            value = values[field.name] if _is_state(field) else _default(field)
            object.__setattr__(new, field.name, value)
        return new

    return make


def _default(field: Field[Any]) -> Any:
    return field.default if field.default_factory is MISSING else field.default_factory()
