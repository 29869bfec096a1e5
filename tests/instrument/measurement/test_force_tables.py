"""Tests of the cache of force tables: a table is computed once, and a damaged file is replaced."""

import numpy as np
import pytest

from pneuforce.instrument.measurement import force_tables
from pneuforce.instrument.model import Balloon, Circuit
from pneuforce.instrument.model.membrane.table import SHAPE, ForceTable


@pytest.fixture
def computed(monkeypatch, tmp_path):
    """Return a list of the balloons whose table was computed. The computation takes no time."""
    balloons = []

    def compute_table(balloon, circuit, sides, progress):
        balloons.append(balloon)
        progress(1, 1)
        return ForceTable(np.full(SHAPE, float(len(balloons))), circuit.ambient_kpa)

    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr("pneuforce.instrument.model.membrane.table.compute_table", compute_table)
    monkeypatch.setattr(force_tables, "_in_memory", {})
    return balloons


def new_process(monkeypatch):
    monkeypatch.setattr(force_tables, "_in_memory", {})


def test_a_table_is_computed_once_and_then_read_from_memory_or_disk(computed, monkeypatch):
    first = force_tables.force_table(Balloon(), Circuit(), 1)
    assert force_tables.force_table(Balloon(), Circuit(), 1) is first
    new_process(monkeypatch)
    assert (force_tables.force_table(Balloon(), Circuit(), 1).values == first.values).all()
    assert len(computed) == 1


@pytest.mark.parametrize(
    "other",
    [
        (Balloon(rest_radius_mm=7.6), Circuit(), 1),
        (Balloon(radius_linear_mm_per_kpa=0.05), Circuit(), 1),
        (Balloon(), Circuit(volume_mm3=12_000.0), 1),
        (Balloon(), Circuit(polytropic=1.1), 1),
        (Balloon(), Circuit(), 2),
    ],
)
def test_another_balloon_or_circuit_has_another_table(computed, other):
    force_tables.force_table(Balloon(), Circuit(), 1)
    force_tables.force_table(*other)
    assert len(computed) == 2


def test_the_stiffness_of_the_paper_changes_no_table(computed):
    force_tables.force_table(Balloon(), Circuit(), 1)
    force_tables.force_table(Balloon(young_kpa=1500.0), Circuit(), 1)
    assert len(computed) == 1


@pytest.mark.parametrize("content", [b"", b"not a table", b"PK\x03\x04 damaged"])
def test_a_damaged_file_is_replaced(computed, monkeypatch, tmp_path, content):
    force_tables.force_table(Balloon(), Circuit(), 1)
    [path] = tmp_path.rglob("*.npz")
    path.write_bytes(content)
    for count in (2, 2):
        new_process(monkeypatch)
        force_tables.force_table(Balloon(), Circuit(), 1)
        assert len(computed) == count


def test_without_a_cache_the_table_is_still_computed(computed, monkeypatch, tmp_path):
    (tmp_path / "pneuforce").write_text("a file instead of the folder")
    assert force_tables.force_table(Balloon(), Circuit(), 1).values.shape == SHAPE
