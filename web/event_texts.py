"""Records of the event log in words for the list of events: without names of registers and of codes."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from itertools import chain
from typing import Any

from pneuforce.instrument.audit.wording import describe_record
from pneuforce.registers.codes import COMMANDS, FAULTS, HOLDERS, REJECT_REASONS
from pneuforce.registers.map import REGISTERS
from pneuforce.web.operator_texts import FAULT_TITLES

_CODE_NAME = re.compile(r"\b[a-z]+(?:_[a-z0-9]+)+\b")
_CHANNELS = {
    "modbus_tcp": "Modbus TCP",
    "modbus_rtu": "Modbus RTU",
    "can": "CAN",
    "web": "web page",
    "mqtt": "MQTT",
    "modbus_tls": "Modbus security",
}
#: Values of a command that an operator reads. Only the command for a new balloon has an argument.
_COMMAND_VALUES = ("command_code", "command_argument")
_ALARMS = ("force_alarm", "force_alarm_2")
#: Title of each fault, by its name and code in the event log.
_FAULTS = {
    f"{FAULTS.names[code].replace('_', ' ')} (fault {code})": title for code, title in FAULT_TITLES.items()
}


def event_message(record: Mapping[str, Any]) -> dict[str, str]:
    """Return a record for the browsers: the time `at`, the `kind`, and a `text`."""
    kind = str(record.get("kind", ""))
    channel, _, address = str(record.get("who", "")).partition(" ")
    who = f"{_CHANNELS.get(channel, channel)} {address}".strip()
    description = describe_record(_for_operators(record)).removeprefix(kind).lstrip(": ")
    text = ": ".join(filter(None, (who, description, str(record.get("result", "")))))
    return {"at": str(record.get("at", "")), "kind": _in_words(kind), "text": _in_words(text)}


def _for_operators(record: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return a record with titles of faults, and commands without their protocol."""
    fields = dict(record)
    if fields.get("kind") == "faults":
        fields |= {name: _titles(fields[name]) for name in ("was", "is") if name in fields}
    if fields.get("kind") in _ALARMS:
        fields |= {name: "on" if fields.get(name) else "off" for name in ("was", "is")}
    if isinstance(values := fields.get("values"), Mapping):
        fields["values"] = _command(values) if "command_code" in values else _available(values)
    if isinstance(counted := fields.get("of"), Mapping):
        fields["of"] = _for_operators(counted)
    return fields


def _titles(names: Any) -> Any:
    return [_FAULTS.get(name, name) for name in names] if isinstance(names, list) else names


def _available(values: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the values of a write, with None for values that were not available."""
    return {
        name: [None if value == "nan" else value for value in pair] if isinstance(pair, list) else pair
        for name, pair in values.items()
    }


def _command(values: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return a command without its key, its sequence number and the values of the previous command."""
    latest = {name: pair[-1:] * 2 for name, pair in values.items() if isinstance(pair, list)}
    shown = _COMMAND_VALUES if "new_balloon" in latest.get("command_code", ()) else _COMMAND_VALUES[:1]
    return {name: latest[name] for name in shown if name in latest}


def _in_words(text: str) -> str:
    """Return a text in which words replace the names of registers, quantities and codes."""
    return _CODE_NAME.sub(lambda found: _WORDS.get(found[0], found[0]), text)


def _register_words() -> Iterator[tuple[str, str]]:
    for register in REGISTERS:
        stem = register.name.removesuffix(f"_{register.unit.lower()}") if register.unit else register.name
        yield register.name, stem.replace("_", " ")


_OTHERS = ("force_alarm", "held_back", "file_changed", "head_before")
_LOGINS = (
    *("wrong_password", "too_many_attempts", "not_logged_in", "not_permitted"),
    *("new_login", "user_changed", "too_many_sessions"),
)
_CODES = chain(*(codes.names.values() for codes in (COMMANDS, HOLDERS, REJECT_REASONS)), _OTHERS, _LOGINS)
_WORDS: Mapping[str, str] = {
    **{name: name.replace("_", " ") for name in _CODES},
    **dict(_register_words()),
    **_CHANNELS,
    "zero_kpa": "zero [kPa]",
    "command_code": "command",
    "command_argument": "argument",
}
