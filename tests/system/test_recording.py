"""Recordings as users make them: of a running instrument, with kills, full disks and what comes after."""

import csv
import json
import os
import pty
import random
import resource
import signal
import socket
import statistics
import subprocess
import sys
import time
from contextlib import ExitStack

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from instrument.cli.record import record
from instrument.errors import ConfigurationError
from instrument.rig.frames import BoardState
from instrument.tape.entry import Kind, encode, told
from instrument.tape.measured import Measured
from instrument.tape.sheet import check_parquet
from tests.instrument.tape.taping import found, same, wanted
from tests.system.fed import Feeder
from tests.system.waiting import wait_for
from tests.typed import LOADED, pneuforce
from teststand.rig import LiveRig
from teststand.stack import start

KILLS = int(os.environ.get("KILLS", "6"))
MOST_LOST_S = 1.0


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("recorded")


@pytest.fixture(scope="module")
def rig(folder):
    with ExitStack() as children:
        yield LiveRig(start(children, folder / "rig", ["--no-hand"]))


@pytest.fixture(scope="module")
def socket_path(rig, folder):
    return folder / "pneuforce.sock"


@pytest.fixture(scope="module")
def recorded(socket_path, folder):
    """A recording of a second, and what the command said of it."""
    done = pneuforce("record", folder / "a.tape", "--socket", socket_path, "--seconds", "1", "--json")
    assert (done.returncode, done.stderr) == (0, "")
    return folder / "a.tape", json.loads(done.stdout)


@pytest.fixture
def feeder(tmp_path):
    with Feeder(tmp_path / "fed.sock") as feeding:
        yield feeding


def started(file, at, *more, **how):
    words = ["record", str(file), "--socket", str(at), *more]
    return subprocess.Popen(
        [sys.executable, "-P", "-m", "instrument", *words],
        stdout=subprocess.PIPE,
        text=True,
        **{"stderr": subprocess.PIPE} | how,
    )


def samples_in(file):
    try:
        return len(found(file).samples)
    except ConfigurationError:  # not begun as yet
        return 0


def refusal(*words):
    refused = pneuforce(*words)
    assert (refused.returncode, refused.stdout) == (2, ""), refused
    (line,) = refused.stderr.strip().splitlines()
    return line


# ---- recording


def test_a_recording_of_a_running_instrument_is_whole_and_says_so(recorded):
    file, told_of_it = recorded
    read = found(file)
    assert (told_of_it["file"], told_of_it["ended"]) == (str(file), "the recorder was stopped")
    assert told_of_it["samples"] == len(read.samples) > 0
    assert told_of_it["bytes"] == file.stat().st_size
    assert read.remark == ""
    assert read.about["configuration"]["rig"]["port"].endswith("rig")
    assert read.about["utc_us"] > 0
    assert read.checkpoint.body
    assert {Kind.RECEIVED, Kind.BEAT} <= {entry.kind for entry in read.inputs}
    steps = {(b.sequence - a.sequence) % 2**16 for a, b in zip(read.samples, read.samples[1:], strict=False)}
    assert steps == {1}


def test_the_instrument_is_found_by_its_configuration(socket_path, folder):
    (folder / "own.toml").write_text(f'[rig]\nport = "/dev/null"\n[local]\nsocket = "{socket_path.name}"\n')
    words = ("--config", folder / "own.toml", "--seconds", "0.3")
    done = pneuforce("record", folder / "by-config.tape", *words)
    assert done.returncode == 0, done.stderr
    assert "samples" in done.stdout
    assert found(folder / "by-config.tape").remark == ""


def test_the_end_of_the_instrument_ends_the_recording_in_good_order(feeder, tmp_path):
    recorder = started(tmp_path / "a.tape", feeder.path)
    wait_for(lambda: samples_in(tmp_path / "a.tape"), bool)
    feeder.finish(encode(told(Kind.END, time.monotonic(), {"why": "asked to stop"})))
    out, err = recorder.communicate(timeout=20)
    assert (recorder.returncode, err) == (0, "")
    assert out.endswith("the instrument ended: asked to stop\n")
    assert found(tmp_path / "a.tape").ending.why == "asked to stop"


@pytest.mark.parametrize(
    ("cut", "why"),
    [
        (Feeder.go, "the instrument closed it"),
        (Feeder.finish, "the instrument goes on, and let go of this recorder, which was too far behind"),
    ],
    ids=["the instrument is gone", "it goes on"],
)
def test_a_connection_that_goes_without_an_end_is_told_now_and_whenever_it_is_read(
    feeder, tmp_path, cut, why
):
    recorder = started(tmp_path / "a.tape", feeder.path)
    wait_for(lambda: samples_in(tmp_path / "a.tape"), bool)
    cut(feeder)
    _, err = recorder.communicate(timeout=20)
    assert recorder.returncode == 1
    assert f"the connection was cut off: {why}" in err
    read = found(tmp_path / "a.tape")
    assert (read.ending.how, read.ending.why) == ("the connection was cut off", why)
    assert f"a.tape ends unasked (the connection was cut off: {why}): " in read.remark
    assert f" s, {len(read.samples)} samples are whole" in read.remark
    told = pneuforce("export", tmp_path / "a.tape", tmp_path / "a.csv")
    assert (told.returncode, told.stderr) == (0, f"pneuforce: {read.remark}\n")


def test_sigterm_ends_it_in_good_order_and_a_terminal_shows_how_far_it_is(feeder, tmp_path):
    ours, its = pty.openpty()
    recorder = started(tmp_path / "a.tape", feeder.path, stderr=its, env={**os.environ, "TERM": "xterm"})
    os.close(its)
    shown = ""
    while BoardState.HOLDING.name.lower() not in shown:
        shown += os.read(ours, 4096).decode()
    recorder.send_signal(signal.SIGTERM)
    out, _ = recorder.communicate(timeout=20)
    os.close(ours)
    assert "samples" in shown
    assert "MB" in shown
    assert recorder.returncode == 0
    assert out.endswith("the recorder was stopped\n")


def test_a_killed_recorder_loses_less_than_a_second_and_nothing_that_it_kept(feeder, tmp_path):
    lost_s, moment = [], random.Random(5)
    for number in range(KILLS):
        file = tmp_path / f"{number}.tape"
        recorder = LOADED.Process(target=record, args=(file, feeder.path, None, True))
        recorder.start()
        wait_for(lambda file=file: samples_in(file), bool)
        time.sleep(moment.uniform(0.0, 0.5))
        recorder.kill()
        killed_s = time.monotonic()
        recorder.join()
        read = found(file)
        want = wanted(len(read.samples))
        kept = [sample.board_time_us for sample in read.samples]
        assert kept == [sample.board_time_us for sample in want.samples]
        assert [int.from_bytes(entry.body, "little") for entry in read.inputs] == [*range(1, len(kept) + 1)]
        assert "no end" in read.remark
        lost_s.append(killed_s - read.inputs[-1].t_s)
    print(f"{KILLS} kills: lost {statistics.median(lost_s):.3f} s, at most {max(lost_s):.3f} s")
    assert statistics.median(lost_s) < MOST_LOST_S  # the greatest is the machine's, when it is busy


def test_a_disk_that_takes_no_more_ends_it_and_the_instrument_knows(rig, socket_path, folder):
    most = 400_000
    file = folder / "full.tape"
    recorder = started(
        file, socket_path, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))
    )
    _, err = recorder.communicate(timeout=30)
    assert recorder.returncode == 1
    (line,) = err.strip().splitlines()
    assert line.startswith(f"pneuforce: {file}: ")
    assert "the file cannot be written: disk I/O error: is the disk full, or " in line
    read = found(file)
    assert f"{len(read.samples)} samples" in line
    assert len(read.samples) > 100
    assert "no end" in read.remark
    rig.wait_for(lambda registers: "maintenance" in registers["status"])
    pneuforce("record", folder / "next.tape", "--socket", socket_path, "--seconds", "0.1")
    rig.wait_for(lambda registers: "maintenance" not in registers["status"])


def test_where_no_instrument_is_a_sentence_says_so_and_no_file_is_left(tmp_path):
    file = tmp_path / "a.tape"
    assert "is an instrument running there?" in refusal("record", file, "--socket", tmp_path / "none.sock")
    (tmp_path / "off.toml").write_text('[rig]\nport = "/dev/null"\n[local]\nsocket = ""\n')
    assert "cannot be recorded" in refusal("record", file, "--config", tmp_path / "off.toml")
    both = ("--config", tmp_path / "off.toml", "--socket", "x")
    assert "give one of them" in refusal("record", file, *both)
    assert not file.exists()


@pytest.mark.parametrize(
    "says", [b"", b"220 mail.example.com ESMTP\r\n" * 9], ids=["nothing", "something else"]
)
def test_who_is_no_instrument_is_not_recorded(tmp_path, says):
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(tmp_path / "other.sock"))
        server.listen()
        server.settimeout(10.0)
        recorder = started(tmp_path / "a.tape", tmp_path / "other.sock")
        link, _ = server.accept()
        link.sendall(says)
        link.recv(1000)
        link.close()
        _, err = recorder.communicate(timeout=20)
    assert recorder.returncode == 2
    assert len(err.strip().splitlines()) == 1
    assert os.listdir(tmp_path) == ["other.sock"]


def test_an_old_recording_is_never_written_over(recorded, socket_path):
    file, _ = recorded
    before = file.read_bytes()
    assert "there already" in refusal("record", file, "--socket", socket_path)
    assert file.read_bytes() == before


# ---- exporting


def test_a_csv_has_every_sample_as_exact_as_it_is(recorded, tmp_path):
    file, _ = recorded
    done = pneuforce("export", file, tmp_path / "a.csv", "--json")
    assert (done.returncode, done.stderr) == (0, "")
    rows = list(csv.DictReader((tmp_path / "a.csv").open()))
    read = found(file)
    summary = json.loads(done.stdout)
    assert (summary["samples"], summary["format"]) == (len(rows), "csv") == (len(read.samples), "csv")
    for row, sample in zip(rows, read.samples, strict=True):
        cells = {name: float(cell) if cell else None for name, cell in row.items()}
        begun = sample._replace(t_s=round(sample.t_s - read.about["begin_s"], 6))
        assert tuple(cells.values()) == same([begun])[0]


def test_without_pyarrow_a_sentence_tells_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(ConfigurationError, match=r"Parquet needs pyarrow: .*-m pip install pyarrow"):
        check_parquet()


def test_parquet_has_types_nulls_and_what_is_known_of_the_recording(recorded, tmp_path):
    file, _ = recorded
    assert pneuforce("export", file, tmp_path / "a.parquet").returncode == 0
    table, read = pq.read_table(tmp_path / "a.parquet"), found(file)
    assert table.column_names == list(Measured._fields)
    kinds = {name: table.schema.field(name).type for name in ("sequence", "force_n", "in_contact")}
    assert kinds == {"sequence": pa.uint32(), "force_n": pa.float64(), "in_contact": pa.bool_()}
    assert table.column("adc_sum").to_pylist() == [sample.adc_sum for sample in read.samples]
    assert table.column("force_n").null_count == sum(s.force_n != s.force_n for s in read.samples) > 0
    said = {key.decode(): json.loads(value) for key, value in table.schema.metadata.items()}
    assert {name.removeprefix("pneuforce."): value for name, value in said.items()} == read.about


def test_a_span_of_time_is_exported(recorded, tmp_path):
    words = ("--from-s", "0.2", "--to-s", "0.4", "--json")
    done = json.loads(pneuforce("export", recorded[0], tmp_path / "a.csv", *words).stdout)
    assert 0.2 <= done["from_s"] < 0.25
    assert 0.35 < done["to_s"] <= 0.4


def test_what_cannot_be_exported_is_refused_in_a_sentence(recorded, tmp_path):
    file, _ = recorded
    before = file.read_bytes()
    assert "is the recording itself" in refusal("export", file, file, "--format", "csv")
    assert "--format" in refusal("export", file, tmp_path / "a.table")
    assert "no samples there" in refusal("export", file, tmp_path / "a.csv", "--from-s", "99")
    assert "less than" in refusal("export", file, tmp_path / "a.csv", "--from-s", "2", "--to-s", "1")
    assert "--reference" in refusal("export", file, tmp_path / "a.csv", "--format", "validation")
    assert "--reference" in refusal("export", file, tmp_path / "a.csv", "--reference", "x")
    assert "no such file" in refusal("export", tmp_path / "none", tmp_path / "a.csv")
    assert "is no recording" in refusal("export", __file__, tmp_path / "a.csv")
    assert os.listdir(tmp_path) == []
    assert file.read_bytes() == before


def test_of_a_damaged_recording_all_that_is_whole_is_exported_and_the_rest_told(recorded, tmp_path):
    (tmp_path / "cut.tape").write_bytes(recorded[0].read_bytes()[: -3 * 4096])
    done = pneuforce("export", tmp_path / "cut.tape", tmp_path / "a.csv")
    assert done.returncode == 1
    assert "are whole" in done.stderr
    rows = (tmp_path / "a.csv").read_text().count("\n") - 1
    assert f"{rows} samples" in done.stdout
    assert 0 < rows < recorded[1]["samples"]
