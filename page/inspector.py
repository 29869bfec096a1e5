"""The buses' own words: what Modbus would answer now, and what the last CAN frames said."""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

from instrument.tape.entry import plain
from registers.can.frames import FRAMES, decode
from registers.map import BLOCKS
from registers.modbus.bank import Bank

_BANK = Bank()
_FRAMES = {frame.name: frame for frame in FRAMES}


def register_blocks(snapshot: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The words of all readable registers as function 03 would answer them, out of one snapshot."""
    shown = SimpleNamespace(
        **{name: math.nan if value is None else value for name, value in snapshot.items()}
    )
    blocks = []
    for first, last in BLOCKS:
        render = _BANK.reader(first, last - first + 1)
        assert render is not None
        words = struct.unpack(f">{last - first + 1}H", render(shown))
        blocks.append({"address": first, "words": words})
    return blocks


def frames(health: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The frames that the CAN node has sent and heard last, each with its values by name."""
    can = health.get("can") or {}
    return [frame | {"values": _values(frame)} for frame in can.get("frames", ())]


def _values(seen: Mapping[str, Any]) -> Any:
    try:
        return plain(decode(_FRAMES[seen["name"]], bytes.fromhex(seen["data"])))
    except (KeyError, ValueError):  # one that is no frame of ours, or has not its length
        return {}
