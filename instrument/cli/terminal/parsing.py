"""Run of a typer application: a usage error is one sentence; changes of the help that typer prints."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import typer
import typer.main

from pneuforce.errors import ConfigurationError
from pneuforce.support.permissions import read_problem

#: Base class of all errors in the words of a command. typer does not export this class.
_WORDS_ERROR: Any = typer.BadParameter.__mro__[1]
#: Unit of a parameter, by the last part of its Python name.
_UNITS = {"kpa": "kPa", "n": "N", "s": "s", "seconds": "s", "days": "days", "mb": "MB", "percent": "%"}


def run(app: typer.Typer) -> int:
    """Run the command that the words of the command line name. Return its exit code.

    Raises ConfigurationError for words that no command accepts, and each error of the command. For a closed
    output, the error is BrokenPipeError, which typer replaces by exit code 1.
    """
    command = typer.main.get_command(app)
    _prepare_help(command)
    try:
        return command(standalone_mode=False) or 0
    except SystemExit as end:
        if isinstance(end.__context__, BrokenPipeError):
            raise end.__context__ from None
        raise
    except _WORDS_ERROR as error:
        if problem := _unreadable_file(error):
            raise ConfigurationError(problem) from None
        message = _range_text(error) or error.format_message().replace("Value error, ", "")
        if not message:  # words without a command: typer has printed the help
            return int(error.exit_code)
        help_command = f" (help: {error.ctx.command_path} -h)" if error.ctx else ""
        message = " ".join(message.split())  # typer writes a list of choices in several lines
        raise ConfigurationError(f"{message[0].lower()}{message[1:].rstrip('.')}{help_command}") from None


def _unreadable_file(error: Any) -> str:
    """Return why the user cannot read a file, with the remedy; "" for every other error."""
    named = re.search("[Pp]ath '(.*)' is not readable", error.format_message(), re.DOTALL)
    return read_problem(Path(named[1])) if named else ""


def _range_text(error: Any) -> str:
    """Return the sentence about a number that is invalid, "" for every other error.

    typer names neither the value nor both limits, and reads a negative argument as an option.
    """
    option, parameter = getattr(error, "option_name", ""), getattr(error, "param", None)
    if re.match("-[0-9.]", option):
        value = next(word for word in sys.argv if word.startswith(option))
        parameter = next(filter(_is_ranged_argument, error.ctx.command.params), None)
    elif hasattr(error.__cause__, "errors"):
        value = error.__cause__.errors()[0]["input"]
    else:
        return ""
    low, high = getattr(parameter, "min", None), getattr(parameter, "max", None)
    if parameter is None:
        return ""
    if low is None:
        is_number = (
            getattr(error.__cause__, "errors", None) and "_parsing" in error.__cause__.errors()[0]["type"]
        )
        return f"{parameter.opts[-1]} = {value} is invalid: it must be a number" if is_number else ""
    allowed = f"at least {low:g}" if high is None else f"{low:g} to {high:g}"
    unit = _UNITS.get(parameter.name.rpartition("_")[2], "")
    text = f"{parameter.opts[-1]} = {value} is invalid: it must be {allowed} {unit}".rstrip()
    return text + (_pressure_hint(value, low, high) if unit == "kPa" and high is not None else "")


def _pressure_hint(value: str, low: float, high: float) -> str:
    """Return which pressure was probably meant, "" if the number is not plausible in another unit."""
    for unit, per_kpa in (("mbar", 10), ("Pa", 1000)):
        try:
            kpa = float(value) / per_kpa
        except ValueError:
            return ""
        if low <= kpa <= high:
            return f"; {value} {unit} are {kpa:g} kPa"
    return ""


def _is_ranged_argument(parameter: Any) -> bool:
    return parameter.param_type_name == "argument" and getattr(parameter, "min", None) is not None


def _prepare_help(command: Any, parent: typer.Context | None = None) -> None:
    """Change the help texts of a command and of its sub-commands.

    - A flag has no type, because it has no value.
    - Sentences have no line breaks. typer prints the line breaks of a docstring, so that the lines of a
      narrow terminal would be broken twice.
    - A default that is given as a text has no parentheses, which typer adds.
    """
    command.help = re.sub(r"(?<![.:!?\n])\n(?!\n)", " ", command.help or "")
    context = typer.Context(command, parent=parent, **command.context_settings)
    for parameter in command.get_params(context):
        if getattr(parameter, "is_flag", False):
            parameter.metavar = ""
        if isinstance(default := getattr(parameter, "show_default", None), str):
            parameter._get_default_string = lambda default=default, **_: default
    for each in getattr(command, "commands", {}).values():
        _prepare_help(each, context)
