"""Tests of docs/reference/python.md: the committed page is current, and each of its examples runs."""

import re
from contextlib import nullcontext

import pytest

import pneuforce
from pneuforce.client.reference_page import PATH, render
from tests.instrument.recording.recording_files import make_recording
from tests.source_tree import ROOT

PAGE = (ROOT / PATH).read_text(encoding="utf-8")
BLOCKS = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
EXAMPLE_URL = "tcp://127.0.0.1:5020"


def name_of(block):
    """Return the heading above an example."""
    return re.findall(r"^#+ (.*)$", PAGE[: PAGE.index(block)], re.MULTILINE)[-1]


@pytest.fixture(scope="module")
def rig():
    with pneuforce.testing.simulated_rig() as rig:
        yield rig


@pytest.fixture
def recording(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return make_recording(tmp_path / "press.recording", 100)


def test_the_committed_page_is_current():
    assert render() == PAGE, "run: python -m pneuforce.client.reference_page"
    assert "| `_" not in PAGE, "the page shows a private attribute"


@pytest.mark.parametrize("block", BLOCKS, ids=name_of)
def test_the_example_runs(block, rig, recording, capsys):
    """Run an example with the instrument of this file, which `simulated_rig` has started."""
    program = block.replace(EXAMPLE_URL, rig.url).replace("pneuforce.testing.simulated_rig()", "running")
    exec(program, {"pneuforce": pneuforce, "running": nullcontext(rig)})
    printed = capsys.readouterr().out
    assert bool(printed) == ("print(" in block) or "except" in block
    assert "nan" not in printed


def test_each_public_name_is_on_the_page():
    assert [name for name in pneuforce.__all__ if not re.search(rf"\b{name}\b", PAGE)] == []
