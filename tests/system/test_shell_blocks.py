"""Tests that the command line accepts every command and option in the documents."""

import re
import shlex
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import pytest
import typer

from pneuforce.instrument.cli.app import app

TOP = Path(__file__).parents[2]
DOCUMENTS = [TOP / "README.md", *sorted((TOP / "docs").rglob("*.md"))]
TREE = typer.main.get_command(app)
#: A command `pneuforce …` in a block or in a sentence, up to the character that ends it.
COMMAND = re.compile(r"(?:^|[ /])pneuforce ((?:[a-z]|--)[^|>&;`#()]*)")

each_document = pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(TOP)))


@cache
def shell_lines(document):
    """Return the lines of the shell blocks, with continued lines joined."""
    blocks = re.findall(r"```sh\n(.*?)```", document.read_text(encoding="utf-8"), re.DOTALL)
    return tuple(line for block in blocks for line in block.replace("\\\n", " ").splitlines())


@cache
def spans(document):
    """Return the texts in code quotes outside of code blocks."""
    prose = re.sub(r"^```.*?^```", "", document.read_text(encoding="utf-8"), flags=re.M | re.S)
    return tuple(re.findall(r"`([^`\n]+)`", prose))


@each_document
def test_no_command_is_expected_on_the_path(document):
    bare = [line for line in shell_lines(document) if re.match(r"(pneuforce|pytest|python3?) ", line)]
    assert bare == []


def commands_of(command):
    return getattr(command, "commands", {})


def unknown_in(words):
    """Return the error for an unknown command or option, or "" if all are known. Values are not checked."""
    command = TREE
    for word in words:
        name = word.partition("=")[0]
        if name.startswith("--"):
            if name not in {"--help", *(o for p in command.params for o in (*p.opts, *p.secondary_opts))}:
                return f"{command.name} has no {name}"
        elif commands := commands_of(command):
            if name not in commands:
                return f"{command.name} has no command {name}"
            command = commands[name]
    return ""


def error_of(words):
    """Return the error of the command line for these words, or "" if they are accepted."""
    command = TREE
    while words and words[0] in commands_of(command):
        command, words = commands_of(command)[words[0]], words[1:]
    try:
        command.make_context("pneuforce", words)
    except typer.Exit:  # --help, --version
        return ""
    except Exception as error:  # click's exception, which typer contains under its own name
        return error.format_message()
    return ""


@each_document
def test_each_command_and_option_in_code_quotes_exists(document):
    commands = [match[1] for span in spans(document) for match in COMMAND.finditer(span)]
    assert [(line, why) for line in commands if (why := unknown_in(line.replace("…", "").split()))] == []


@each_document
def test_each_command_in_a_shell_block_is_accepted(document):
    lines = [match[1] for line in shell_lines(document) for match in COMMAND.finditer(line.split("  #")[0])]
    assert [(line, why) for line in lines if (why := error_of(shlex.split(line)))] == []


@each_document
def test_each_module_file_and_make_target_exists(document):
    targets = re.findall(r"^([a-z-]+):", (TOP / "Makefile").read_text(), re.MULTILINE)
    for text in (*shell_lines(document), *spans(document)):
        for module in re.findall(r"python -m ((?:pneuforce|tests)[\w.]*)", text):
            assert find_spec(module), text
        for file in re.findall(r"python ((?:docs|tests)/\S+\.py)", text):
            assert (TOP / file).exists(), text
        for target in re.findall(r"^make ([a-z-]+)", text):
            assert target in targets, text


def test_unknown_commands_and_options_are_detected():
    assert unknown_in(["watch", "modbus", "--loudly"]) == "watch has no --loudly"
    assert unknown_in(["log", "burn"]) == "log has no command burn"
    assert "--loudly" in error_of(["watch", "modbus", "--loudly"])
    assert "carrier-pigeon" in error_of(["watch", "carrier-pigeon"])
    assert "pdf" in error_of(["map", "--format", "pdf"])
