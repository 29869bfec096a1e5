import numpy as np
import pytest

from sim.membrane import cache as kept
from sim.membrane.material import MOONEY_RIVLIN, Rubber
from sim.membrane.table import COLUMNS, ROWS, Table


@pytest.fixture
def builds(monkeypatch, tmp_path):
    """Tables that are quick to build, in a cache of their own; the list tells what was built."""
    built = []

    def build(rubber, sides, progress):
        built.append((rubber, sides))
        progress(1, 1)
        grid = np.full((ROWS, COLUMNS), rubber.mu_kpa)
        return Table(np.arange(ROWS, dtype=float), np.ones(ROWS), grid, grid)

    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(kept, "build", build)
    return built


def table(rubber=MOONEY_RIVLIN, sides=1):
    return kept.kept_table(rubber, sides, lambda _done, _total: None)


def test_a_table_is_built_once(builds):
    first, second = table(), table()
    assert len(builds) == 1
    assert (first.pressure_kpa == second.pressure_kpa).all()


def test_another_balloon_is_another_table(builds):
    assert table().pressure_kpa[0, 0] != table(Rubber(mu_kpa=300.0)).pressure_kpa[0, 0]
    table(sides=2)
    assert len(builds) == 3


@pytest.mark.parametrize("spoil", ["empty", "half", "foreign", "key", "nan", "pickle", "directory"])
def test_a_file_that_is_not_a_table_is_replaced(builds, spoil):
    sound = table()
    (path,) = kept.directory().iterdir()
    whole = path.read_bytes()
    arrays = dict(np.load(path))
    if spoil == "directory":
        path.unlink()
        path.mkdir()
    elif spoil in ("key", "nan", "pickle"):
        change = {"key": ("key", "0"), "nan": ("highest_n", arrays["highest_n"] * np.nan)}
        name, value = change.get(spoil, ("highest_n", np.array([{}], dtype=object)))
        np.savez(path, **{**arrays, name: value})
    else:
        path.write_bytes({"empty": b"", "half": whole[: len(whole) // 2], "foreign": b"not a table"}[spoil])
    assert (table().pressure_kpa == sound.pressure_kpa).all()
    assert len(builds) == 2
    if spoil != "directory":
        table()
        assert len(builds) == 2
    assert [p.name for p in kept.directory().iterdir()] == [path.name]


def test_a_cache_that_cannot_be_written_is_no_cache(builds, monkeypatch, tmp_path):
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert table().gas_kpa_mm3.size == ROWS
    table()
    assert len(builds) == 2
