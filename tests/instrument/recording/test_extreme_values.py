"""Tests of recordings that contain extreme numbers: each command reads them or prints one sentence."""

import csv
import itertools
import math
import random

import pyarrow.parquet as pq
import pytest

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.cli.model.force_options import ForceOptions
from pneuforce.instrument.cli.model.validate import OutputFiles, validate
from pneuforce.instrument.cli.model.validation_source import SourceOptions
from pneuforce.instrument.cli.recordings.export import ExportOptions, export
from pneuforce.instrument.cli.recordings.plot import plot
from pneuforce.instrument.measurement.measurement import Measurement, Quality
from pneuforce.instrument.recording.plot_data import MAX_SPANS, PlotData
from pneuforce.instrument.recording.writer import RecordingWriter
from pneuforce.instrument.rig.link import RawSample
from pneuforce.instrument.stream.entry import EntryKind, StreamEntry, json_entry
from pneuforce.instrument.stream.sample_record import pack, unpack
from pneuforce.instrument.validation.recording_plot import PlotOptions
from pneuforce.instrument.validation.reference_alignment import ReferenceInput
from pneuforce.protocol.frames import BoardState, Sample, Valve
from tests.instrument.recording.recording_files import BEGIN_S, HEADER, read_contents

MAX_FLOAT, MIN_FLOAT = 1.7976931348623157e308, 5e-324
EXTREMES = (1e308, -1e308, MAX_FLOAT, math.inf, -math.inf, math.nan, MIN_FLOAT, -MIN_FLOAT, 1e15, -1e7, 0.0)
FIELDS = Measurement._fields[1:12]
SAMPLES = 60
COMMON = {"pressure_kpa": 8.5, "unfiltered_kpa": 8.5, "baseline_kpa": 8.0, "rise_kpa": 1.0, "radius_mm": 8.0}
COMMON |= {"force_n": 1.0, "force_std_n": 0.1}


def sample_entry(number, state=BoardState.HOLDING, fault=0, **values):
    """Return a SAMPLE entry. Every tenth sample has no contact."""
    t_s = BEGIN_S + number * 0.002
    message = Sample(2000 * number, 3000, 5000, Valve.NONE, state, fault, 0, 1, 8000)
    in_contact = number % 10 != 0
    m = Measurement(t_s, **COMMON | values, in_contact=in_contact, quality=Quality.GOOD)
    return StreamEntry(EntryKind.SAMPLE, t_s, pack(RawSample(number, t_s, message), m))


def record(path, entries, **header):
    file = RecordingWriter(path)
    file.add_entry(json_entry(EntryKind.HEADER, BEGIN_S, HEADER | header))
    for entry in entries:
        file.add_entry(entry)
    file.commit()
    file.close()
    return path


NO_FILES = OutputFiles(recording=None, figures=None, overwrite=False)


def draw(path, **options):
    plot(PlotOptions(path, path.with_suffix(".png"), overwrite=True, **options))


@pytest.mark.parametrize("name", ["all fields", *FIELDS])
def test_a_recording_with_extreme_numbers_is_plotted(tmp_path, name):
    numbers = itertools.cycle(EXTREMES)
    names = FIELDS if name == "all fields" else (name,)
    entries = [sample_entry(n, **{field: next(numbers) for field in names}) for n in range(SAMPLES)]
    draw(record(tmp_path / "a.recording", entries))
    draw(tmp_path / "a.recording", by_pressure=True)


@pytest.mark.parametrize("value", EXTREMES)
def test_a_recording_with_one_extreme_number_in_each_sample_is_plotted(tmp_path, value):
    values = dict.fromkeys(FIELDS, value)
    draw(record(tmp_path / "a.recording", [sample_entry(n, **values) for n in range(SAMPLES)]))
    draw(tmp_path / "a.recording", by_pressure=True)


def test_a_recording_with_random_extreme_numbers_is_plotted(tmp_path):
    chance = random.Random(1)
    for number in range(5):
        entries = [
            sample_entry(n, **{field: chance.choice((1.0, *EXTREMES)) for field in FIELDS})
            for n in range(SAMPLES)
        ]
        draw(record(tmp_path / f"{number}.recording", entries))
        draw(tmp_path / f"{number}.recording", by_pressure=True)


@pytest.fixture
def extreme(tmp_path):
    """Return a recording in which each sample has another extreme number in each field."""
    numbers = itertools.cycle(EXTREMES)
    entries = [sample_entry(n, **{field: next(numbers) for field in FIELDS}) for n in range(SAMPLES)]
    return record(tmp_path / "a.recording", entries)


def test_extreme_numbers_are_read_and_exported_to_the_last_bit(extreme, tmp_path):
    export(extreme, ExportOptions(tmp_path / "a.csv"), as_json=False)
    export(extreme, ExportOptions(tmp_path / "a.parquet"), as_json=False)
    samples = read_contents(extreme).samples
    assert len(samples) == SAMPLES
    rows = list(csv.DictReader((tmp_path / "a.csv").open()))
    table = pq.read_table(tmp_path / "a.parquet").to_pylist()
    for sample, row, values in zip(samples, rows, table, strict=True):
        for name in FIELDS:
            recorded = getattr(sample, name)
            is_missing = math.isnan(recorded)
            assert row[name] == ("" if is_missing else repr(recorded))
            assert values[name] == (None if is_missing else recorded)


def test_an_exported_recording_with_extreme_pressures_is_not_validated(extreme, tmp_path):
    (tmp_path / "cell.csv").write_text("t_s,force_n\n" + "".join(f"{n / 20},1.0\n" for n in range(20)))
    options = ExportOptions(
        tmp_path / "v.csv", "validation", reference=ReferenceInput(tmp_path / "cell.csv", offset_s=0.0)
    )
    export(extreme, options, as_json=False)
    with pytest.raises(ConfigurationError, match="pressure_kpa"):
        validate(SourceOptions(data=tmp_path / "v.csv"), ForceOptions(), NO_FILES, as_json=False)


def test_a_fault_name_with_formulas_and_control_characters_is_plotted(tmp_path):
    name = "$\\frac{1}{$\x1b[2J\n" * 5000
    facts = {"kind": "faults", "mono_s": BEGIN_S + 0.01, "is": [name] * 20 + ["a"] * 5000}
    entries = [sample_entry(n, BoardState.VENTED) for n in range(SAMPLES)]
    draw(record(tmp_path / "a.recording", [*entries, json_entry(EntryKind.EVENT, BEGIN_S, facts)]))


def test_the_number_of_vented_spans_in_a_plot_is_limited():
    data = PlotData(BEGIN_S)
    for number in range(3 * MAX_SPANS):
        data.add_sample(unpack(sample_entry(number, BoardState.TRIPPED, fault=1 + number % 5).body))
    assert len(data.spans) == MAX_SPANS
    assert data.has_more_spans
