"""The help of every command: whole sentences, in which no unit is taken for markup."""

import re
from pathlib import Path

import pytest
import typer.main

from instrument.cli.app import app
from instrument.cli.panel import _typed

LOOKS_LIKE_MARKUP = r"\[[a-zA-Z³°/]+\]"


def commands(group, name="pneuforce"):
    yield name, group
    if hasattr(group, "commands"):
        for word, command in group.commands.items():
            yield from commands(command, f"{name} {word}")


COMMANDS = dict(commands(typer.main.get_command(app)))


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_and_option_says_what_it_is_in_a_sentence(name):
    own = COMMANDS[name]
    texts = [own.help, *(p.help for p in own.params if getattr(p, "help", None))]
    for text in texts:
        assert not re.search(LOOKS_LIKE_MARKUP, text), text
        assert text.split("\n\n")[0].rstrip().endswith((".", ":", "!")), text


def test_the_demo_names_the_program_as_it_was_typed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", str(tmp_path / "nowhere"))
    assert _typed(Path(".venv/bin/pneuforce")) == ".venv/bin/pneuforce"
    assert _typed(tmp_path / ".venv/bin/pneuforce") == ".venv/bin/pneuforce"
    assert _typed(Path("/opt/pneuforce/bin/pneuforce")) == "/opt/pneuforce/bin/pneuforce"
    assert _typed(Path("/x/instrument/__main__.py")).endswith("-m instrument")
