"""Test of docs/tutorials/analysis.ipynb: each cell runs, and the calibrated forces are the applied forces."""

import json
import shutil

import numpy as np
import pytest

from pneuforce.sim.factory import build_world
from pneuforce.sim.scenario import load
from tests.instrument.recording.virtual_host import VirtualHost, write_recording
from tests.source_tree import ROOT

TUTORIALS = ROOT / "docs/tutorials"
RECORDING = "/tmp/press.recording"
APPLIED_N = np.array([1.0, 2.0, 3.0])
NOTEBOOK = json.loads((TUTORIALS / "analysis.ipynb").read_text(encoding="utf-8"))
CODE = ["".join(cell["source"]) for cell in NOTEBOOK["cells"] if cell["cell_type"] == "code"]


def record(path):
    """Record the scenario of the tutorial in virtual time."""
    host = VirtualHost(world=build_world(load(str(TUTORIALS / "rubber-balloon.toml"))))
    host.inflate(8.0)
    host.record()
    host.run(13.0)
    write_recording(host.recorded(), path)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Return a folder like docs/, with a recording beside it."""
    shutil.copytree(ROOT / "docs/examples", tmp_path / "examples")
    (tmp_path / "tutorials").mkdir()
    record(tmp_path / "press.recording")
    monkeypatch.chdir(tmp_path / "tutorials")
    return tmp_path


def test_each_cell_runs_and_the_calibrated_forces_are_the_applied_forces(folder):
    """Run the cells one after the other, because a Jupyter kernel would take longer than the cells."""
    import matplotlib.pyplot as plt

    plt.switch_backend("agg")
    names = {}
    for cell in CODE:
        exec(cell.replace(RECORDING, str(folder / "press.recording")), names)
    names["folder"].cleanup()
    assert list((folder / "tutorials").iterdir()) == []
    assert len(plt.get_fignums()) == 3
    plt.close("all")
    calibrated_n = names["calibrated_n"]
    assert len(calibrated_n) >= 3
    nearest_n = APPLIED_N[np.abs(calibrated_n[:, None] - APPLIED_N).argmin(axis=1)]
    assert set(nearest_n) == set(APPLIED_N)
    assert np.abs(calibrated_n / nearest_n - 1).max() < 0.05
    assert np.abs(names["bare_n"] / nearest_n - 1).max() > 0.2


def test_the_notebook_reads_the_recording_that_its_command_writes():
    assert f'"{RECORDING}"' in CODE[0]
    assert f"pneuforce record {RECORDING} " in "".join(NOTEBOOK["cells"][0]["source"])


def test_the_notebook_is_committed_without_outputs_and_in_format_4():
    assert (NOTEBOOK["nbformat"], NOTEBOOK["nbformat_minor"]) == (4, 5)
    for cell in NOTEBOOK["cells"]:
        assert cell["cell_type"] == "markdown" or (cell["outputs"], cell["execution_count"]) == ([], None)
    assert len({cell["id"] for cell in NOTEBOOK["cells"]}) == len(NOTEBOOK["cells"])
