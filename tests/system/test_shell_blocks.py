"""What the documents tell to type: it runs in a clone as it stands, and its commands and options are ours."""

import re
import shlex
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import pytest
import typer

from instrument.cli.app import app

TOP = Path(__file__).parents[2]
DOCUMENTS = [TOP / "README.md", *sorted((TOP / "docs").rglob("*.md"))]
TREE = typer.main.get_command(app)
#: A command of ours, in a block or within a sentence, up to what ends it.
OURS = re.compile(r"(?:^|[ /])pneuforce ((?:[a-z]|--)[^|>&;`#()]*)")

each_document = pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(TOP)))


@cache
def shell_lines(document):
    """Lines of the shell blocks, those that go on joined."""
    blocks = re.findall(r"```sh\n(.*?)```", document.read_text(encoding="utf-8"), re.DOTALL)
    return tuple(line for block in blocks for line in block.replace("\\\n", " ").splitlines())


@cache
def spans(document):
    """What stands in code quotes within the prose."""
    prose = re.sub(r"^```.*?^```", "", document.read_text(encoding="utf-8"), flags=re.M | re.S)
    return tuple(re.findall(r"`([^`\n]+)`", prose))


@each_document
def test_no_command_is_expected_on_the_path(document):
    bare = [line for line in shell_lines(document) if re.match(r"(pneuforce|pytest|python3?) ", line)]
    assert bare == []


def commands_of(command):
    return getattr(command, "commands", {})


def wrong_in(words):
    """What our command line does not know of these words; values are not looked at."""
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


def refused(words):
    """What our command line would say to a line that is typed as it stands, before it does anything."""
    command = TREE
    while words and words[0] in commands_of(command):
        command, words = commands_of(command)[words[0]], words[1:]
    try:
        command.make_context("pneuforce", words)
    except typer.Exit:  # --help, --version
        return ""
    except Exception as error:  # of click's, which typer brings along under a name of its own
        return error.format_message()
    return ""


@each_document
def test_each_command_and_option_in_code_quotes_is_ours(document):
    told = [match[1] for span in spans(document) for match in OURS.finditer(span)]
    assert [(line, why) for line in told if (why := wrong_in(line.replace("…", "").split()))] == []


@each_document
def test_each_command_in_a_shell_block_is_one_that_our_command_line_takes(document):
    lines = [match[1] for line in shell_lines(document) for match in OURS.finditer(line.split("  #")[0])]
    assert [(line, why) for line in lines if (why := refused(shlex.split(line)))] == []


@each_document
def test_each_program_of_ours_and_each_target_of_make_is_there(document):
    targets = re.findall(r"^([a-z-]+):", (TOP / "Makefile").read_text(), re.MULTILINE)
    for text in (*shell_lines(document), *spans(document)):
        for module in re.findall(
            r"python -m ((?:instrument|registers|sim|tests|page|teststand)[\w.]*)", text
        ):
            assert find_spec(module), text
        for file in re.findall(r"python ((?:docs|tests)/\S+\.py)", text):
            assert (TOP / file).exists(), text
        for target in re.findall(r"^make ([a-z-]+)", text):
            assert target in targets, text


def test_a_command_that_is_not_ours_is_seen():
    assert wrong_in(["watch", "modbus", "--loudly"]) == "watch has no --loudly"
    assert wrong_in(["log", "burn"]) == "log has no command burn"
    assert "--loudly" in refused(["watch", "modbus", "--loudly"])
    assert "carrier-pigeon" in refused(["watch", "carrier-pigeon"])
    assert "pdf" in refused(["map", "--format", "pdf"])
