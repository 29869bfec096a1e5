"""Content of the parameter file: the node id that LSS has stored, and the parameters of object 1010h."""

from __future__ import annotations

import json
import zlib
from collections.abc import Mapping
from typing import Any, NamedTuple

from pneuforce.registers.canopen.entry import EntryAddress

_FORMAT = 1
_NODE_IDS = range(128)


class StoredParameters(NamedTuple):
    """Values that a master has stored. They replace the values of the configuration at the next start."""

    node_id: int = 0  #: 0: the node id of the configuration is used
    #: Communication parameters by index and sub-index. COB-IDs are relative to the node id.
    values: Mapping[EntryAddress, int] = {}


def encode(stored: StoredParameters, configured_node_id: int) -> bytes:
    """Return the content of the file. The file belongs to a configuration with the given node id."""
    content = {
        "format": _FORMAT,
        "configured_node_id": configured_node_id,
        "node_id": stored.node_id,
        "objects": {f"{index:04X}:{sub}": value for (index, sub), value in sorted(stored.values.items())},
    }
    return json.dumps(content | {"crc32": _checksum(content)}, indent=1).encode() + b"\n"


def decode(content: bytes, configured_node_id: int) -> StoredParameters:
    """Return the values in the content of a file.

    Raises ValueError if the file is damaged, or if the node id was changed in the configuration since then.
    """
    try:
        read = json.loads(content)
        checksum = read.pop("crc32")
        if read["format"] != _FORMAT or checksum != _checksum(read):
            raise ValueError
        stored = StoredParameters(_node_id(read["node_id"]), dict(map(_value, read["objects"].items())))
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError):
        raise ValueError("it is damaged, or was not written by this instrument") from None
    if read["configured_node_id"] != configured_node_id:
        raise ValueError(
            f"it was written for node id {read['configured_node_id']} of the configuration, "
            f"which is now {configured_node_id}"
        )
    return stored


def _checksum(content: Mapping[str, Any]) -> int:
    return zlib.crc32(json.dumps(content, sort_keys=True).encode())


def _node_id(value: Any) -> int:
    if type(value) is not int or value not in _NODE_IDS:
        raise ValueError
    return value


def _value(item: tuple[str, Any]) -> tuple[EntryAddress, int]:
    address, value = item
    index, _, subindex = address.partition(":")
    if type(value) is not int:
        raise ValueError
    return (int(index, 16), int(subindex)), value
