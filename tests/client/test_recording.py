"""Tests of `pneuforce.Recording`: arrays, units, tables, parts, and damaged files."""

import numpy as np
import pandas
import polars
import pytest

import pneuforce
from tests.instrument.recording.recording_files import BEGIN_S, DT_S, HEADER, make_recording, read_contents

COUNT = 1500


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return make_recording(tmp_path_factory.mktemp("recording") / "press.recording", COUNT)


@pytest.fixture(scope="module")
def recording(path):
    return pneuforce.Recording(path)


def test_each_column_is_an_array_with_the_recorded_values(path, recording):
    samples = read_contents(path).samples
    assert list(recording) == [*samples[0]._fields, "board_s"]
    assert recording["board_s"] == pytest.approx(0.002 * np.arange(len(samples)))
    for name in samples[0]._fields:
        recorded = np.array([getattr(sample, name) for sample in samples])
        if name == "t_s":
            recorded = (recorded - BEGIN_S).round(6)
        assert np.array_equal(recording[name], recorded, equal_nan=recorded.dtype.kind == "f")


def test_a_missing_force_is_nan_and_not_valid(recording):
    assert recording.valid.sum() == COUNT * 4 // 5
    assert np.isnan(recording["force_n"][~recording.valid]).all()
    assert recording["in_contact"].dtype == bool


def test_the_units_follow_from_the_names(recording):
    assert recording.units["force_n"] == "N"
    assert recording.units["pressure_kpa"] == "kPa"
    assert recording.units["radius_mm"] == "mm"
    assert recording.units["t_s"] == "s"
    assert recording.units["quality"] == ""


def test_the_properties_of_the_instrument_are_read(recording):
    assert recording.metadata["version"] == HEADER["version"]
    assert recording.duration_s == pytest.approx((COUNT - 1) * DT_S)
    assert [event["which"] for event in recording.events] == list(range(100, COUNT + 1, 100))
    assert not recording.simulated
    assert recording.remark == ""


def test_a_part_is_selected(path):
    part = pneuforce.Recording(path, from_s=1.0, to_s=1.1)
    assert part["t_s"].min() >= 1.0
    assert part["t_s"].max() <= 1.1
    assert len(part["t_s"]) == 51
    empty = pneuforce.Recording(path, from_s=1e6)
    assert (len(empty["t_s"]), empty.duration_s) == (0, 0.0)


def test_the_tables_have_the_same_values(recording):
    frame, table = recording.to_pandas(), recording.to_polars()
    assert isinstance(frame, pandas.DataFrame)
    assert isinstance(table, polars.DataFrame)
    assert list(frame.columns) == table.columns == list(recording)
    for name in recording:
        assert np.array_equal(
            frame[name].to_numpy(), recording[name], equal_nan=recording[name].dtype.kind == "f"
        )
    assert table["force_n"].null_count() == COUNT // 5
    assert table["force_n"].max() == np.nanmax(recording["force_n"])


def test_a_table_without_its_library_is_a_configuration_error(recording, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "pandas", None)
    with pytest.raises(pneuforce.ConfigurationError, match="pip install pandas"):
        recording.to_pandas()


def test_an_unknown_column_names_similar_columns(recording):
    with pytest.raises(KeyError, match="force_n"):
        recording["force"]


def test_a_name_of_another_type_is_an_unknown_column(recording):
    assert (0 in recording, recording.get(0)) == (False, None)
    with pytest.raises(KeyError, match=r"no column 0; columns: .*force_n"):
        recording[0]


def test_the_arrays_are_read_only(recording):
    assert [name for name, array in recording.items() if array.flags.writeable] == []
    assert recording.to_pandas()["force_n"].to_numpy(copy=True).flags.writeable


def test_a_damaged_file_gives_the_samples_before_the_damage_and_a_warning(path, tmp_path):
    damaged = tmp_path / "damaged.recording"
    data = bytearray(path.read_bytes())
    data[-len(data) // 4 :] = bytes(len(data) // 4)
    damaged.write_bytes(data)
    with pytest.warns(UserWarning, match="damaged"):
        recording = pneuforce.Recording(damaged)
    assert len(recording["t_s"]) < COUNT
    assert recording.remark


def test_other_files_are_configuration_errors(tmp_path):
    (tmp_path / "text").write_text("force")
    for name in ("text", "missing"):
        with pytest.raises(pneuforce.ConfigurationError):
            pneuforce.Recording(tmp_path / name)
    with pytest.raises(pneuforce.ConfigurationError):
        pneuforce.Recording(tmp_path / "text", from_s=2.0, to_s=1.0)
    with pytest.raises(pneuforce.ConfigurationError):
        pneuforce.Recording(tmp_path / "text", from_s="1")
    with pytest.raises(pneuforce.ConfigurationError):
        pneuforce.Recording(3)
    with pytest.raises(pneuforce.ConfigurationError, match="must be the path of a recording"):
        pneuforce.Recording("")


def test_a_recording_is_equal_only_to_itself(path, recording):
    assert recording == recording
    assert recording != pneuforce.Recording(path)
    assert recording in {recording}
