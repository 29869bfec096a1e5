"""Damaged and forged copies of a recording. A forged copy has correct checksums."""

from __future__ import annotations

import json
import math
import random
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

from pneuforce.instrument.recording.schema import TABLES, checksum
from pneuforce.instrument.stream.entry import MAX_BODY_BYTES, EntryDecoder, EntryKind, StreamEntry, encode

PAGE_BYTES = 4096
NUMBERS = (1e308, -1e308, math.inf, -math.inf, math.nan, 5e-324, -0.0, 0.5, 1e11, 1e15, -1.0)
INTEGERS = (-1, 0, 1, 7, 255, 256, 65_535, 65_536, 2**32, 2**53 + 1, 2**62, -(2**63))
TEXTS = ("", "text", "NaN", "\x1b[2J\r\n", "$\\frac{1}{$", "\u202e\u0000", "9" * 5000, "x" * 100_000)
BLOBS = (b"", b"\x00", b"\xff" * 100, bytes(10_000), b"\x80\x05})" + b"2\x86" * 60 + b"Ns.")
VALUES: tuple[Any, ...] = (None, *NUMBERS, *INTEGERS, *TEXTS, *BLOBS)
JSON_VALUES: tuple[Any, ...] = (
    None,
    True,
    [],
    {},
    [[[[]]]],
    ["a"] * 5000,
    {"": 0},
    *NUMBERS,
    *INTEGERS,
    *TEXTS,
)
JSON_TEXTS = (
    "[" * 100_000,
    '{"a":' * 50_000,
    "9" * 4000,
    "1e999",
    "nul",
    '"\\ud800"',
    "[[" * 15 + "]]" * 15,
    "",
)


# ---- damage to the bytes of a file


def flip_bits(data: bytearray, chance: random.Random) -> None:
    """Flip up to 50 bits."""
    for _ in range(chance.choice((1, 1, 5, 50))):
        data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)


def truncate(data: bytearray, chance: random.Random) -> None:
    """Remove the end."""
    del data[chance.randrange(1, len(data)) :]


def overwrite(data: bytearray, chance: random.Random) -> None:
    """Replace up to 10 000 bytes by random bytes or by zeros."""
    at, length = chance.randrange(len(data)), chance.choice((1, 16, 500, 10_000))
    length = min(length, len(data) - at)
    data[at : at + length] = chance.randbytes(length) if chance.random() < 0.7 else bytes(length)


def exchange_pages(data: bytearray, chance: random.Random) -> None:
    """Exchange two pages of the database."""
    a, b = (PAGE_BYTES * chance.randrange(len(data) // PAGE_BYTES) for _ in range(2))
    data[a : a + PAGE_BYTES], data[b : b + PAGE_BYTES] = data[b : b + PAGE_BYTES], data[a : a + PAGE_BYTES]


def damage_header(data: bytearray, chance: random.Random) -> None:
    """Change bytes in the header of the database or in its schema."""
    for _ in range(chance.choice((1, 2, 8))):
        data[chance.randrange(PAGE_BYTES)] = chance.randrange(256)


# ---- forged rows with correct checksums


def _rows(db: sqlite3.Connection, table: str) -> list[tuple[Any, ...]]:
    return db.execute(f"SELECT * FROM {table}").fetchall()


def _replace_row(db: sqlite3.Connection, table: str, row: list[Any]) -> None:
    """Write a row with its checksum. A value without a checksum keeps a wrong checksum."""
    try:
        row[-1] = checksum(row[:-1])
    except Exception:
        row[-1] = 0
    marks = ", ".join("?" * len(row))
    db.execute(f"INSERT OR REPLACE INTO {table} VALUES ({marks})", row)


def forge_values(db: sqlite3.Connection, chance: random.Random) -> None:
    """Replace values in rows of any table."""
    table = chance.choice([table for table in TABLES if _rows(db, table)])
    for _ in range(chance.choice((1, 1, 20))):
        row = list(chance.choice(_rows(db, table)))
        row[chance.randrange(1, len(row) - 1)] = chance.choice(VALUES)
        _replace_row(db, table, row)


def forge_numbers(db: sqlite3.Connection, chance: random.Random) -> None:
    """Replace numbers in many samples by extreme numbers."""
    column = chance.randrange(11, len(TABLES["samples"]) - 1)
    for row in chance.sample(_rows(db, "samples"), chance.choice((1, 20, 200))):
        forged = list(row)
        forged[column if chance.random() < 0.7 else chance.randrange(1, len(row) - 1)] = chance.choice(
            NUMBERS
        )
        _replace_row(db, "samples", forged)


def exchange_rows(db: sqlite3.Connection, chance: random.Random) -> None:
    """Exchange the contents of two rows, with or without correct checksums."""
    table = chance.choice(("samples", "inputs", "events"))
    a, b = (list(row) for row in chance.sample(_rows(db, table), 2))
    a[0], b[0] = b[0], a[0]
    for row in (a, b):
        if chance.random() < 0.8:
            _replace_row(db, table, row)
        else:
            db.execute(f"INSERT OR REPLACE INTO {table} VALUES ({', '.join('?' * len(row))})", row)


def remove_rows(db: sqlite3.Connection, chance: random.Random) -> None:
    """Remove rows of a table, or all its rows."""
    table = chance.choice(tuple(TABLES))
    limit = chance.choice((1, 5, 10_000))
    db.execute(
        f"DELETE FROM {table} WHERE number IN (SELECT number FROM {table} ORDER BY random() LIMIT {limit})"
    )


def forge_inputs(db: sqlite3.Connection, chance: random.Random) -> None:
    """Change inputs: their kinds, times, bodies and order."""
    row = list(chance.choice(_rows(db, "inputs")))
    entries = EntryDecoder().feed(row[2])
    for _ in range(chance.choice((1, 1, 10))):
        at = chance.randrange(len(entries))
        entries[at] = _forged_entry(entries[at], chance)
    if chance.random() < 0.2:
        chance.shuffle(entries)
    row[2] = b"".join(map(encode, entries))
    if chance.random() < 0.2:
        row[2] = row[2][: chance.randrange(len(row[2]))]
    _replace_row(db, "inputs", row)


def _forged_entry(entry: StreamEntry, chance: random.Random) -> StreamEntry:
    kind, t_s, body = entry
    match chance.randrange(5):
        case 0:
            kind = chance.choice(list(EntryKind))
        case 1:
            t_s = chance.choice((*NUMBERS, t_s + 1e6, t_s - 1.0))
        case 2:
            body = chance.choice((b"", chance.randbytes(48), b"\xa5\x5a" * 5000, body * 50))[:MAX_BODY_BYTES]
        case 3:
            kind, body = EntryKind.WRITE, chance.choice(JSON_TEXTS).encode()
        case 4:
            names = ("mode", "setpoint_requested_kpa", "force_limit_n", "lease_s", "command_sequence", "x")
            values = {chance.choice(names): chance.choice(JSON_VALUES) for _ in range(3)}
            peer = chance.choice((["modbus_tcp", "10.0.0.1"], ["web", ""], [[], 1], "web"))
            kind, body = EntryKind.WRITE, json.dumps([*peer, values]).encode()
    return StreamEntry(kind, t_s, body)


def forge_json(db: sqlite3.Connection, chance: random.Random) -> None:
    """Change JSON texts in the header and in the events."""
    table, column = chance.choice((("about", 2), ("events", 3)))
    rows = _rows(db, table)
    for _ in range(chance.choice((1, 3))):
        row = list(chance.choice(rows))
        if chance.random() < 0.3:
            row[column] = chance.choice(JSON_TEXTS)
        elif table == "about":
            row[column] = json.dumps(chance.choice(JSON_VALUES))
        else:
            keys = ("kind", "is", "mono_s", "at")
            forged = {"kind": "faults", chance.choice(keys): chance.choice(JSON_VALUES)}
            row[column] = json.dumps(json.loads(row[column]) | forged)
        _replace_row(db, table, row)


def forge_checkpoint(db: sqlite3.Connection, chance: random.Random) -> None:
    """Replace values in the checkpoint."""
    row = list(_rows(db, "checkpoint")[0])
    document = json.loads(row[2])
    for _ in range(chance.choice((1, 1, 5))):
        part: Any = document
        while isinstance(part, dict | list) and part:
            key = chance.choice(list(part) if isinstance(part, dict) else range(len(part)))
            if not isinstance(part[key], dict | list) or chance.random() < 0.1:
                part[key] = _forged_value(part[key], chance)
                break
            part = part[key]
    row[2] = json.dumps(document).encode()
    _replace_row(db, "checkpoint", row)


def _forged_value(value: Any, chance: random.Random) -> Any:
    if isinstance(value, bool) or chance.random() < 0.2:
        return chance.choice((True, False, *JSON_VALUES))
    if isinstance(value, int):
        return chance.choice(INTEGERS)
    return chance.choice(NUMBERS if isinstance(value, float) else JSON_VALUES)


DAMAGES: tuple[Callable[[bytearray, random.Random], None], ...] = (
    flip_bits,
    truncate,
    overwrite,
    exchange_pages,
    damage_header,
)
FORGERIES: tuple[Callable[[sqlite3.Connection, random.Random], None], ...] = (
    forge_values,
    forge_numbers,
    exchange_rows,
    remove_rows,
    forge_inputs,
    forge_json,
    forge_checkpoint,
)


def write_damaged(path: Path, intact: bytes, chance: random.Random) -> str:
    """Write a damaged copy of a recording. Return the name of the damage."""
    damage, data = chance.choice(DAMAGES), bytearray(intact)
    damage(data, chance)
    path.write_bytes(data)
    return damage.__name__


def write_forged(path: Path, intact: bytes, chance: random.Random) -> str:
    """Write a copy of a recording with forged rows. Return the name of the forgery."""
    forge = chance.choice(FORGERIES)
    path.write_bytes(intact)
    with closing(sqlite3.connect(path)) as db:
        forge(db, chance)
        db.commit()
        db.execute("PRAGMA journal_mode = DELETE")
    return forge.__name__
