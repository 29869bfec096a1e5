import gc
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier

import numpy as np
import pytest

from pneuforce.sim.plants.membrane import cache as table_cache
from pneuforce.sim.plants.membrane.material import MOONEY_RIVLIN, NEO_HOOKEAN, Skin
from pneuforce.sim.plants.membrane.paths import PressedBalloon, press_nodes
from pneuforce.sim.plants.membrane.plant import MembranePlant
from pneuforce.sim.plants.membrane.table import COLUMNS, FRACTIONS, NODES, ROWS, MembraneTable


@pytest.fixture
def computed(monkeypatch, tmp_path):
    """Use an empty cache and a fast computation of tables. Return the list of computed tables."""
    tables = []

    def compute(rubber, sides, contact, progress):
        tables.append((rubber, sides, contact))
        progress(1, 1)
        grid = np.full((ROWS, COLUMNS), rubber.mu_kpa)
        return MembraneTable(np.arange(ROWS, dtype=float), np.ones(ROWS), grid, grid)

    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(table_cache, "compute_table", compute)
    return tables


def table(rubber=MOONEY_RIVLIN, sides=1, contact="slide"):
    return table_cache.cached_table(rubber, sides, contact, lambda _done, _total: None)


def test_a_table_is_computed_once(computed):
    first, second = table(), table()
    assert len(computed) == 1
    assert (first.pressure_kpa == second.pressure_kpa).all()


def test_another_balloon_has_another_table(computed):
    assert table().pressure_kpa[0, 0] != table(NEO_HOOKEAN).pressure_kpa[0, 0]
    table(sides=2)
    table(contact="stick")
    assert len(computed) == len(set(computed)) == 4


@pytest.mark.parametrize("damage", ["empty", "half", "foreign", "key", "nan", "pickle", "directory"])
def test_an_invalid_file_is_replaced(computed, damage):
    valid = table()
    (path,) = table_cache.cache_directory().iterdir()
    content = path.read_bytes()
    arrays = dict(np.load(path))
    if damage == "directory":
        path.unlink()
        path.mkdir()
    elif damage in ("key", "nan", "pickle"):
        change = {"key": ("key", "0"), "nan": ("highest_n", arrays["highest_n"] * np.nan)}
        name, value = change.get(damage, ("highest_n", np.array([{}], dtype=object)))
        np.savez(path, **{**arrays, name: value})
    else:
        path.write_bytes(
            {"empty": b"", "half": content[: len(content) // 2], "foreign": b"not a table"}[damage]
        )
    assert (table().pressure_kpa == valid.pressure_kpa).all()
    assert len(computed) == 2
    if damage != "directory":
        table()
        assert len(computed) == 2
    assert [p.name for p in table_cache.cache_directory().iterdir()] == [path.name]


def encrypted(content):
    """Return a zip file whose entries are marked as encrypted."""
    return content.replace(b"PK\x01\x02\x2d\x03\x2d\x00\x00\x00", b"PK\x01\x02\x2d\x03\x2d\x00\x01\x00")


def unknown_compression(content):
    """Return a zip file with an unknown compression method."""
    head = b"PK\x01\x02\x2d\x03\x2d\x00\x00\x00"
    return content.replace(head + b"\x00\x00", head + b"\x63\x00")


def unterminated(content):
    """Return the first array of a file, with a header that is not terminated."""
    start = content.index(b"\x93NUMPY")
    return content[start:].replace(b"}", b" ", 1)


@pytest.mark.parametrize("damage", [encrypted, unknown_compression, unterminated])
@pytest.mark.filterwarnings("error")
def test_a_file_with_a_damaged_header_is_replaced_and_closed(computed, damage):
    valid = table()
    (path,) = table_cache.cache_directory().iterdir()
    damaged = damage(path.read_bytes())
    assert damaged != path.read_bytes()
    path.write_bytes(damaged)
    assert (table().pressure_kpa == valid.pressure_kpa).all()
    gc.collect()
    assert len(computed) == 2
    table()
    assert len(computed) == 2


@pytest.mark.parametrize(("in_cache", "expected"), [([], [0.5, 1.0]), (["slide"], [1.0]), (["stick"], [0.5])])
def test_the_progress_of_two_tables_is_one_progress(computed, in_cache, expected):
    shares = []
    for contact in in_cache:
        table(contact=contact)
    MembranePlant(contact=0.4, progress=lambda done, total: shares.append(done / total))
    assert shares == expected


def test_the_progress_of_a_table_ends_at_the_number_of_its_nodes():
    nodes = press_nodes(PressedBalloon(Skin(MOONEY_RIVLIN)), np.array([1.3]), FRACTIONS)
    assert len(list(nodes)) == NODES


def test_two_threads_that_compute_at_once_both_get_a_table_and_leave_one_file(computed, monkeypatch):
    fast, both_running = table_cache.compute_table, Barrier(2, timeout=600)

    def compute(rubber, sides, contact, progress):
        both_running.wait()
        return fast(rubber, sides, contact, progress)

    monkeypatch.setattr(table_cache, "compute_table", compute)
    with ThreadPoolExecutor(2) as pool:
        tables = list(pool.map(lambda _: table(), range(2)))
    assert (tables[0].pressure_kpa == tables[1].pressure_kpa).all()
    assert len(list(table_cache.cache_directory().iterdir())) == 1


def test_a_cache_that_cannot_be_written_is_ignored(computed, monkeypatch, tmp_path):
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert table().gas_kpa_mm3.size == ROWS
    table()
    assert len(computed) == 2
