"""Commands of host applications: vent, and rebirth. Everything else is rejected."""

from __future__ import annotations

from collections.abc import Collection
from enum import StrEnum, auto
from typing import NamedTuple

from pneuforce.mqtt.payload import InvalidPayload, decode_command
from pneuforce.registers.sparkplug import REBIRTH, VENT
from pneuforce.support.printable import printable

MAX_NAME = 40  #: characters of a received name that the log shows


class SparkplugCommand(StrEnum):
    """Command that the edge node executes."""

    VENT = auto()
    REBIRTH = auto()


class ParsedCommands(NamedTuple):
    """Commands of one message, and a sentence for each metric that is rejected."""

    commands: Collection[SparkplugCommand]
    rejected: list[str]


_COMMANDS = {VENT: SparkplugCommand.VENT, REBIRTH: SparkplugCommand.REBIRTH}


def parse_commands(data: bytes, *, retained: bool = False) -> ParsedCommands:
    """Return the commands in the payload of a message NCMD or DCMD.

    A retained message is rejected: the broker repeats an old command after each connection.
    """
    if retained:
        return ParsedCommands((), ["a retained command is not executed: delete it in the broker"])
    try:
        metrics = decode_command(data)
    except InvalidPayload as error:
        return ParsedCommands((), [f"a command is not executed: {error}"])
    commands: list[SparkplugCommand] = []
    rejected: list[str] = []
    for metric in metrics:
        command = _COMMANDS.get(metric.name)
        name = printable(metric.name[:MAX_NAME])
        if command is None:
            rejected.append(f"a write of {name} is rejected: MQTT can only vent")
        elif metric.value is not True:
            rejected.append(f"the command {name} is not executed: its value must be the Boolean true")
        else:
            commands.append(command)
    if not metrics:
        rejected.append("a command without a metric is not executed")
    return ParsedCommands(commands, rejected)
