import gc
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier

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


def encrypted(whole):
    """A zip file whose entries say that they are encrypted."""
    return whole.replace(b"PK\x01\x02\x2d\x03\x2d\x00\x00\x00", b"PK\x01\x02\x2d\x03\x2d\x00\x01\x00")


def packed_oddly(whole):
    """A zip file by a method of packing that nobody knows."""
    head = b"PK\x01\x02\x2d\x03\x2d\x00\x00\x00"
    return whole.replace(head + b"\x00\x00", head + b"\x63\x00")


def unclosed(whole):
    """One array, whose header never ends."""
    begin = whole.index(b"\x93NUMPY")
    return whole[begin:].replace(b"}", b" ", 1)


@pytest.mark.parametrize("spoil", [encrypted, packed_oddly, unclosed])
@pytest.mark.filterwarnings("error")
def test_a_file_that_lies_about_itself_is_replaced_and_closed(builds, spoil):
    sound = table()
    (path,) = kept.directory().iterdir()
    spoilt = spoil(path.read_bytes())
    assert spoilt != path.read_bytes()
    path.write_bytes(spoilt)
    assert (table().pressure_kpa == sound.pressure_kpa).all()
    gc.collect()
    assert len(builds) == 2
    table()
    assert len(builds) == 2


def test_two_that_build_at_once_both_have_a_table_and_leave_one(builds, monkeypatch):
    quick, both_in = kept.build, Barrier(2, timeout=10)

    def build(rubber, sides, progress):
        both_in.wait()
        return quick(rubber, sides, progress)

    monkeypatch.setattr(kept, "build", build)
    with ThreadPoolExecutor(2) as pool:
        tables = list(pool.map(lambda _: table(), range(2)))
    assert (tables[0].pressure_kpa == tables[1].pressure_kpa).all()
    assert len(list(kept.directory().iterdir())) == 1


def test_a_cache_that_cannot_be_written_is_no_cache(builds, monkeypatch, tmp_path):
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert table().gas_kpa_mm3.size == ROWS
    table()
    assert len(builds) == 2
