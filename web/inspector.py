"""Raw data of the buses for the inspector: Modbus words of a snapshot, and the latest CAN frames."""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

from pneuforce.instrument.stream.entry import json_safe
from pneuforce.registers.can.frames import FRAMES, decode
from pneuforce.registers.map import BLOCKS
from pneuforce.registers.modbus.register_bank import RegisterBank

_BANK = RegisterBank()
_FRAMES = {frame.name: frame for frame in FRAMES}


def register_blocks(snapshot: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the words that Modbus function 03 would return for all readable registers and this snapshot.

    Each block is {"address": first address, "words": tuple of int}.
    """
    source = SimpleNamespace(
        **{name: math.nan if value is None else value for name, value in snapshot.items()}
    )
    blocks = []
    for first, last in BLOCKS:
        count = last - first + 1
        render = _BANK.reader(first, count)
        assert render is not None
        words = struct.unpack(f">{count}H", render(source))
        blocks.append({"address": first, "words": words})
    return blocks


def can_frames(health: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the latest frames that the CAN node sent and received.

    "values" of each frame contains the decoded values by field name.
    """
    can = health.get("can") or {}
    return [frame | {"values": _decoded(frame)} for frame in can.get("frames", ())]


def _decoded(frame: Mapping[str, Any]) -> Any:
    try:
        return json_safe(decode(_FRAMES[frame["name"]], bytes.fromhex(frame["data"])))
    except (KeyError, ValueError):  # unknown frame name, or wrong length
        return {}
