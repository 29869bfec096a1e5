"""Tests of the help texts: sentences without units in brackets, because typer reads brackets as markup."""

import re
from pathlib import Path

import pytest
import typer.main
from typer.testing import CliRunner

from pneuforce.instrument.cli.app import app
from pneuforce.instrument.cli.panel import _program_to_type
from pneuforce.instrument.cli.terminal.parsing import _prepare_help
from tests.command_runner import pneuforce

LOOKS_LIKE_MARKUP = r"\[[a-zA-Z³°/]+\]"


def commands_of(group, name="pneuforce"):
    """Yield the name and the command of a group and of all its sub-commands."""
    yield name, group
    if hasattr(group, "commands"):
        for word, command in group.commands.items():
            yield from commands_of(command, f"{name} {word}")


COMMANDS = dict(commands_of(typer.main.get_command(app)))


@pytest.mark.parametrize("name", COMMANDS)
def test_the_help_of_every_command_and_option_is_a_sentence(name):
    command = COMMANDS[name]
    texts = [command.help, *(p.help for p in command.params if getattr(p, "help", None))]
    for text in texts:
        assert not re.search(LOOKS_LIKE_MARKUP, text), text
        assert text.split("\n\n")[0].rstrip().endswith((".", ":", "!")), text


@pytest.mark.parametrize("name", COMMANDS)
def test_the_short_option_prints_the_help_of_every_command(name):
    shown = CliRunner().invoke(app, [*name.split()[1:], "-h"])
    assert (shown.exit_code, shown.output.count("Usage: ")) == (0, 1)


def test_each_default_is_printed_without_parentheses(capsys):
    """typer prints a default that is given as a text in parentheses."""
    root = typer.main.get_command(app)
    _prepare_help(root)
    shown = "".join(_help_of(command, name, capsys) for name, command in commands_of(root))
    assert "[default: 5]" in shown  # of the node id of the command map
    assert re.findall(r"\[default: \(.*", shown) == []


def _help_of(command, name, capsys):
    with pytest.raises(SystemExit):
        command(["-h"], prog_name=name)
    return " ".join(capsys.readouterr().out.replace("│", "").split())


def test_a_line_of_the_help_ends_only_at_the_end_of_a_sentence():
    """typer keeps the line breaks of a docstring, and a terminal with 80 columns would break a line twice."""
    root = typer.main.get_command(app)
    _prepare_help(root)
    broken = [
        line
        for _, command in commands_of(root)
        for line in re.findall(r"^(.*)\n(?!\n)", command.help, re.MULTILINE)
        if line and not line.endswith((".", ":", "!", "?"))
    ]
    assert broken == []
    assert "The recording is not changed. Give --config or --calibration," in " ".join(
        pneuforce("evaluate", "-h").stdout.replace("│", "").split()
    )


def test_the_demo_names_the_program_as_the_user_typed_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", str(tmp_path / "nowhere"))
    assert _program_to_type(Path(".venv/bin/pneuforce")) == ".venv/bin/pneuforce"
    assert _program_to_type(tmp_path / ".venv/bin/pneuforce") == ".venv/bin/pneuforce"
    assert _program_to_type(Path("/opt/pneuforce/bin/pneuforce")) == "/opt/pneuforce/bin/pneuforce"
    assert _program_to_type(Path("/x/pneuforce/__main__.py")).endswith("-m pneuforce")
