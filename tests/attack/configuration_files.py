"""Random configuration files: the example configuration with a few changes."""

from __future__ import annotations

import json
import math
import random
import tomllib
from typing import Any

from pneuforce.instrument.config import example

TEXTS = [
    *("", " ", ".", "..", "/", "//", "\0", "a\0b", "\n", "\t", "\x1b[2J", "\x7f", "\x85", "\u202e", "\ufeff"),
    *(
        "a..b",
        ".a",
        "a.",
        "-a",
        "a-",
        "a_b",
        "a b",
        "é.example",
        "İ",
        "ﬀ",
        "xn--",
        "xn--\u00fc",
        "\u3002",
        "☃" * 40,
    ),
    *(
        "x" * 64,
        "x" * 500,
        "x" * 5000,
        "a." * 200,
        "é" * 100,
        "localhost",
        "LOCALHOST",
        "localhost.",
        "rig.example",
    ),
    *(
        "0",
        "127.1",
        "0x7f.1",
        "1.2.3.4.5",
        "127.0.0.1 ",
        "::1",
        "[::1]",
        "::1%lo",
        "::1%\0",
        "::ffff:127.0.0.1",
    ),
    *("0.0.0.0", "::", "10.0.0.1/8", "10.0.0.0/8", "0.0.0.0/0", "1.2.3.4/99", "fe80::1%eth0/64", "fe80::/64"),
    *("socket://h:1", "socket://h:0", "socket://h:99999", "socket://", "socket://:5", "socket://[::1]:5"),
    *("socket://a..b:5", "socket://h:5?logging=debug", "socket://h:5/x", "SOCKET://h:5", "socket://h:²"),
    *(
        "alt:///dev/null?class=os",
        "alt:///dev/null?class=PosixPollSerial",
        "loop://",
        "loop://?logging=debug",
    ),
    *(
        "spy:///dev/null",
        "hwgrep://.*",
        "rfc2217://h:1",
        "cp2110://0",
        "x://y",
        "://",
        "/dev/x://y",
        "/dev/missing",
    ),
    *(
        "even",
        "canopen",
        "virtual",
        "socketcand",
        "../../x",
        "%s",
        "{}",
        "$HOME",
        "~",
        "a" * 12,
        "\U0010ffff",
    ),
]
NUMBERS = [
    *(
        0,
        -1,
        1,
        2,
        3,
        64,
        127,
        128,
        255,
        65_535,
        65_536,
        2**31,
        2**63,
        2**64,
        -(2**63),
        10**400,
        19_000_229,
        99_991_231,
    ),
    *(0.0, -0.0, 0.5, 1e-308, 5e-324, 1e308, -1e308, math.nan, math.inf, -math.inf, 1.0000000000000002),
]
#: Valid values that are invalid together with other valid values, or with a long path of the file.
COMBINATIONS = [
    ("local", "socket", ""),
    ("local", "socket", "x" * 100),
    ("local", "socket", "é" * 60),
    ("modbus_rtu", "port", "/dev/ttyACM0"),
    ("can", "bit_rate", 125_000),
    ("measurement", "calibration", "instrument.toml"),
]
#: Text that is inserted into the file.
PIECES = [
    *(
        "\0",
        "\x01",
        "\x7f",
        "\r",
        "\ufeff",
        "[",
        "[[",
        "]]",
        "{",
        "=",
        '"""',
        "#",
        "\\",
        "[rig]\n",
        "[modbus.port]\n",
    ),
    *("x = 1979-05-27T07:32:00Z\n", "x = 0x" + "f" * 400 + "\n", "x = 1" + "0" * 5000 + "\n", "x = 1e999\n"),
    *(
        "x = " + "[" * 2000,
        "x = " + "[" * 50 + "]" * 50 + "\n",
        "a" + ".a" * 1500 + " = 1\n",
        "[" + "a." * 400 + "a]\n",
    ),
]


class Inline(str):
    """Text that is already TOML."""


def toml(value: Any) -> str:
    """Return a value as TOML. JSON text is TOML text, except for DEL."""
    if isinstance(value, Inline):
        return value
    if isinstance(value, dict):
        return "{" + ", ".join(f"{toml(key)} = {toml(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return f"[{', '.join(map(toml, value))}]"
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, str):
        escaped = (f"\\U{ord(c):08x}" if c in '"\\' or not c.isprintable() else c for c in value)
        return f'"{"".join(escaped)}"'
    return json.dumps(value)


def any_value(rng: random.Random, depth: int = 0) -> Any:
    """Return a text, a number, a date, a list or a table."""
    kind = rng.random()
    if kind < 0.45:
        text = rng.choice(TEXTS)
        return text + rng.choice(TEXTS) if rng.random() < 0.1 else text
    if kind < 0.75:
        return rng.choice(NUMBERS)
    if kind < 0.85:
        return rng.choice(
            [True, False, Inline("1979-05-27T07:32:00Z"), Inline("07:32:00"), Inline("1979-05-27")]
        )
    items = [any_value(rng, depth + 1) for _ in range(rng.choice((0, 1, 3, 70)) if depth < 2 else 0)]
    return items if kind < 0.95 else {str(number): item for number, item in enumerate(items)}


def value_like(before: Any, rng: random.Random) -> Any:
    """Return a value that often has the same type as the value before."""
    if rng.random() < 0.3:
        return any_value(rng)
    if isinstance(before, str):
        return rng.choice(TEXTS)
    if isinstance(before, list):
        return [rng.choice(TEXTS) for _ in range(rng.choice((1, 2, 65)))]
    if isinstance(before, int | float) and 1 <= abs(before) <= 1e6:
        return rng.choice([*NUMBERS, type(before)(before * rng.uniform(0.5, 2))])
    return rng.choice(NUMBERS)


def changed(tables: dict[str, Any], rng: random.Random) -> None:
    """Change one value, key or table."""
    name = rng.choice(list(tables))
    table, kind = tables[name], rng.random()
    if kind < 0.9 and isinstance(table, dict) and table:
        key = rng.choice(list(table))
        if rng.random() < 0.85:
            table[key] = value_like(table[key], rng)
        else:
            table[rng.choice([key.upper(), rng.choice(TEXTS), "port"])] = table.pop(key)
    elif kind < 0.95:
        tables[name] = any_value(rng)
    else:
        tables[rng.choice(TEXTS)] = any_value(rng)


def any_file(rng: random.Random) -> bytes:
    """Return the content of a configuration file that is often valid."""
    tables = tomllib.loads(example())
    for name in ("modbus_rtu", "can", "web"):
        tables[name]["enabled"] = rng.random() < 0.5
    if rng.random() < 0.5:
        for name in ("modbus", "web"):
            tables[name]["allow"] = ["10.0.0.0/8"]
    for _ in range(rng.choice((0, 1, 1, 2, 4))):
        changed(tables, rng)
    if rng.random() < 0.1:
        name, key, value = rng.choice(COMBINATIONS)
        tables[name] = tomllib.loads(example())[name] | {"enabled": True, key: value}
        if name in ("local", "measurement"):
            del tables[name]["enabled"]
    lines = []
    for name, table in tables.items():
        if isinstance(table, dict):
            lines += [f"[{toml(name)}]", *(f"{toml(key)} = {toml(value)}" for key, value in table.items())]
        else:
            lines.insert(0, f"{toml(name)} = {toml(table)}")
    content = "\n".join(lines).encode()
    if rng.random() < 0.1:
        at = rng.randrange(len(content))
        piece = rng.choice(PIECES).encode() if rng.random() < 0.8 else rng.randbytes(3)
        content = content[:at] + piece + content[at + rng.choice((0, 0, 5)) :]
    return content
