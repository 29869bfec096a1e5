"""Tests of recording and export, with killed processes and full disks."""

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

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.cli.recordings.record import RecordEnd, record
from pneuforce.instrument.cli.terminal.exit_codes import ExitCode
from pneuforce.instrument.recording.schema import EndReason
from pneuforce.instrument.recording.table_export import check_parquet
from pneuforce.instrument.service.local_socket.recorder import NO_END
from pneuforce.instrument.stream.entry import EntryKind, encode, json_entry
from pneuforce.instrument.stream.sample_record import SampleRecord
from pneuforce.protocol.frames import BoardState
from pneuforce.support.write_error import REMEDY
from pneuforce.teststand.rig import LiveRig
from pneuforce.teststand.stack import start
from tests.command_runner import FORKSERVER, pneuforce
from tests.instrument.recording.recording_files import comparable, expected_contents, read_contents
from tests.system.stream_feeder import StreamFeeder
from tests.system.waiting import wait_for

KILLS = int(os.environ.get("KILLS", "6"))
MAX_LOST_S = 1.0


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
    """Return a recording of one second and the JSON output of the command."""
    done = pneuforce("record", folder / "a.recording", "--socket", socket_path, "--seconds", "1", "--json")
    assert (done.returncode, done.stderr) == (0, "")
    return folder / "a.recording", json.loads(done.stdout)


@pytest.fixture
def feeder(tmp_path):
    with StreamFeeder(tmp_path / "feeder.sock") as running:
        yield running


def start_recorder(file, at, *more, **options):
    words = ["record", str(file), "--socket", str(at), *more]
    return subprocess.Popen(
        [sys.executable, "-P", "-m", "pneuforce", *words],
        stdout=subprocess.PIPE,
        text=True,
        **{"stderr": subprocess.PIPE} | options,
    )


def samples_in(file):
    try:
        return len(read_contents(file).samples)
    except ConfigurationError:  # no header yet
        return 0


def error_line(*words, code=2):
    rejected = pneuforce(*words)
    assert (rejected.returncode, rejected.stdout) == (code, ""), rejected
    (line,) = rejected.stderr.strip().splitlines()
    return line


# ---- recording


def test_a_recording_of_a_running_instrument_is_complete(recorded):
    file, summary = recorded
    contents = read_contents(file)
    assert (summary["file"], summary["ended"]) == (str(file), EndReason.STOPPED)
    assert summary["why"] == contents.ending.why == "the time of 1 s is over"
    assert summary["message"].endswith("; the time of 1 s is over")
    assert summary["samples"] == len(contents.samples) > 0
    assert summary["bytes"] == file.stat().st_size
    assert contents.remark == ""
    assert contents.metadata["configuration"]["rig"]["port"].endswith("rig")
    assert contents.metadata["utc_us"] > 0
    assert contents.checkpoint.body
    assert {EntryKind.RECEIVED, EntryKind.TICK} <= {entry.kind for entry in contents.inputs}
    steps = {
        (b.sequence - a.sequence) % 2**16
        for a, b in zip(contents.samples, contents.samples[1:], strict=False)
    }
    assert steps == {1}


def test_the_socket_is_taken_from_the_configuration(socket_path, folder):
    (folder / "instrument.toml").write_text(
        f'[rig]\nport = "/dev/null"\n[local]\nsocket = "{socket_path.name}"\n'
    )
    words = ("--config", folder / "instrument.toml", "--seconds", "0.3")
    done = pneuforce("record", folder / "by-config.recording", *words)
    assert done.returncode == 0, done.stderr
    assert "samples" in done.stdout
    assert read_contents(folder / "by-config.recording").remark == ""


def test_the_end_of_the_instrument_ends_the_recording_normally(feeder, tmp_path):
    recorder = start_recorder(tmp_path / "a.recording", feeder.path)
    wait_for(lambda: samples_in(tmp_path / "a.recording"), bool)
    feeder.close_connection(encode(json_entry(EntryKind.END, time.monotonic(), {"why": "stop requested"})))
    out, err = recorder.communicate(timeout=60)
    assert (recorder.returncode, err) == (0, "")
    assert out.endswith("the instrument ended: stop requested\n")
    assert read_contents(tmp_path / "a.recording").ending.why == "stop requested"


@pytest.mark.parametrize(
    "close",
    [StreamFeeder.close_all, StreamFeeder.close_connection],
    ids=["instrument killed", "instrument runs"],
)
def test_a_lost_connection_is_reported_now_and_at_each_reading(feeder, tmp_path, close):
    recorder = start_recorder(tmp_path / "a.recording", feeder.path)
    wait_for(lambda: samples_in(tmp_path / "a.recording"), bool)
    close(feeder)
    _, err = recorder.communicate(timeout=60)
    assert recorder.returncode == 1
    contents = read_contents(tmp_path / "a.recording")
    assert contents.ending.how == EndReason.CUT_OFF
    assert contents.ending.why == NO_END
    reason = f"{EndReason.CUT_OFF}: {contents.ending.why}"
    assert reason in err
    assert f"a.recording ended unexpectedly ({reason}): " in contents.remark
    assert f" s, {len(contents.samples)} samples are intact" in contents.remark
    done = pneuforce("export", tmp_path / "a.recording", tmp_path / "a.csv")
    assert (done.returncode, done.stderr) == (0, f"pneuforce: {contents.remark}\n")


def test_sigterm_ends_a_recording_normally_and_a_terminal_shows_its_progress(feeder, tmp_path):
    master, slave = pty.openpty()
    recorder = start_recorder(
        tmp_path / "a.recording", feeder.path, stderr=slave, env={**os.environ, "TERM": "xterm"}
    )
    os.close(slave)
    shown = ""
    while BoardState.HOLDING.name.lower() not in shown:
        shown += os.read(master, 4096).decode()
    recorder.send_signal(signal.SIGTERM)
    out, _ = recorder.communicate(timeout=60)
    os.close(master)
    assert "samples" in shown
    assert "MB" in shown
    assert recorder.returncode == 0
    assert out.endswith("the recorder was stopped\n")


def test_a_killed_recorder_loses_less_than_a_second_and_no_committed_sample(feeder, tmp_path):
    lost_s, chance = [], random.Random(5)
    for number in range(KILLS):
        file = tmp_path / f"{number}.recording"
        recorder = FORKSERVER.Process(target=record, args=(file, feeder.path, RecordEnd(), True))
        recorder.start()
        wait_for(lambda file=file: samples_in(file), bool)
        time.sleep(chance.uniform(0.0, 0.5))
        recorder.kill()
        killed_s = time.monotonic()
        recorder.join()
        contents = read_contents(file)
        expected = expected_contents(len(contents.samples))
        times_us = [sample.board_time_us for sample in contents.samples]
        assert times_us == [sample.board_time_us for sample in expected.samples]
        assert [int.from_bytes(entry.body, "little") for entry in contents.inputs] == [
            *range(1, len(times_us) + 1)
        ]
        assert "no end" in contents.remark
        lost_s.append(killed_s - contents.inputs[-1].t_s)
    print(f"{KILLS} kills: lost {statistics.median(lost_s):.3f} s, at most {max(lost_s):.3f} s")
    assert statistics.median(lost_s) < MAX_LOST_S  # the maximum depends on the load of the machine


def test_a_full_disk_ends_the_recording_and_sets_the_maintenance_bit(rig, socket_path, folder):
    limit_bytes = 400_000
    file = folder / "full.recording"
    recorder = start_recorder(
        file,
        socket_path,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit_bytes, limit_bytes)),
    )
    _, err = recorder.communicate(timeout=60)
    assert recorder.returncode == ExitCode.IO_ERROR
    (line,) = err.strip().splitlines()
    assert line.startswith(f"pneuforce: {file}: ")
    assert line.endswith(REMEDY)
    assert "the file cannot be written: disk I/O error: is the disk full, or " in line
    contents = read_contents(file)
    assert f"{len(contents.samples)} samples" in line
    assert len(contents.samples) > 100
    assert "no end" in contents.remark
    rig.wait_for(lambda registers: "maintenance_required" in registers["status"])
    pneuforce("record", folder / "next.recording", "--socket", socket_path, "--seconds", "0.1")
    rig.wait_for(lambda registers: "maintenance_required" not in registers["status"])


def test_without_an_instrument_the_error_is_one_line_and_no_file_is_left(tmp_path):
    file = tmp_path / "a.recording"
    assert "none.sock" in error_line("record", file, "--socket", tmp_path / "none.sock", code=69)
    (tmp_path / "off.toml").write_text('[rig]\nport = "/dev/null"\n[local]\nsocket = ""\n')
    assert "local.socket" in error_line("record", file, "--config", tmp_path / "off.toml")
    both = ("--config", tmp_path / "off.toml", "--socket", "x")
    assert "--socket" in error_line("record", file, *both)
    assert not file.exists()


@pytest.mark.parametrize(
    "data", [b"", b"220 mail.example.com ESMTP\r\n" * 9], ids=["nothing", "something else"]
)
def test_a_server_that_is_not_an_instrument_is_not_recorded(tmp_path, data):
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(tmp_path / "other.sock"))
        server.listen()
        server.settimeout(10.0)
        recorder = start_recorder(tmp_path / "a.recording", tmp_path / "other.sock")
        link, _ = server.accept()
        link.sendall(data)
        link.recv(1000)
        link.close()
        _, err = recorder.communicate(timeout=60)
    assert recorder.returncode == 69
    assert len(err.strip().splitlines()) == 1
    assert os.listdir(tmp_path) == ["other.sock"]


def test_an_existing_recording_is_not_overwritten(recorded, socket_path):
    file, _ = recorded
    before = file.read_bytes()
    assert "exists already" in error_line("record", file, "--socket", socket_path)
    assert file.read_bytes() == before


# ---- exporting


def test_a_csv_has_each_sample_with_full_precision(recorded, tmp_path):
    file, _ = recorded
    done = pneuforce("export", file, tmp_path / "a.csv", "--json")
    assert (done.returncode, done.stderr) == (0, "")
    rows = list(csv.DictReader((tmp_path / "a.csv").open()))
    contents = read_contents(file)
    summary = json.loads(done.stdout)
    assert (summary["samples"], summary["format"]) == (len(rows), "csv") == (len(contents.samples), "csv")
    for row, sample in zip(rows, contents.samples, strict=True):
        cells = {name: float(cell) if cell else None for name, cell in row.items()}
        board_s = cells.pop("board_s")
        assert board_s == pytest.approx((sample.board_time_us - contents.samples[0].board_time_us) / 1e6)
        expected = sample._replace(t_s=round(sample.t_s - contents.metadata["begin_s"], 6))
        assert tuple(cells.values()) == comparable([expected])[0]


def test_without_pyarrow_the_message_has_the_command_to_install_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(ConfigurationError, match=r"-m pip install pyarrow"):
        check_parquet()


def test_parquet_has_types_nulls_and_the_metadata_of_the_recording(recorded, tmp_path):
    file, _ = recorded
    assert pneuforce("export", file, tmp_path / "a.parquet").returncode == 0
    table, contents = pq.read_table(tmp_path / "a.parquet"), read_contents(file)
    assert table.column_names == [*SampleRecord._fields, "board_s"]
    kinds = {name: table.schema.field(name).type for name in ("sequence", "force_n", "in_contact")}
    assert kinds == {"sequence": pa.uint32(), "force_n": pa.float64(), "in_contact": pa.bool_()}
    assert table.column("adc_sum").to_pylist() == [sample.adc_sum for sample in contents.samples]
    assert table.column("force_n").null_count == sum(s.force_n != s.force_n for s in contents.samples) > 0
    metadata = {key.decode(): json.loads(value) for key, value in table.schema.metadata.items()}
    assert {name.removeprefix("pneuforce."): value for name, value in metadata.items()} == contents.metadata


def test_a_time_span_is_exported(recorded, tmp_path):
    words = ("--from-s", "0.2", "--to-s", "0.4", "--json")
    done = json.loads(pneuforce("export", recorded[0], tmp_path / "a.csv", *words).stdout)
    assert 0.2 <= done["from_s"] < 0.25
    assert 0.35 < done["to_s"] <= 0.4


def test_invalid_arguments_of_export_are_rejected_in_one_line(recorded, tmp_path):
    file, _ = recorded
    before = file.read_bytes()
    assert "is the recording itself" in error_line("export", file, file, "--format", "csv")
    assert "--format" in error_line("export", file, tmp_path / "a.table")
    assert "name a file" in error_line("export", file, "-", "--format", "csv")
    assert "no samples in this time range" in error_line("export", file, tmp_path / "a.csv", "--from-s", "99")
    assert "less than" in error_line("export", file, tmp_path / "a.csv", "--from-s", "2", "--to-s", "1")
    assert "--reference" in error_line("export", file, tmp_path / "a.csv", "--format", "validation")
    assert "--reference" in error_line("export", file, tmp_path / "a.csv", "--reference", "x")
    assert "does not exist" in error_line("export", tmp_path / "none", tmp_path / "a.csv")
    assert "is not a recording" in error_line("export", __file__, tmp_path / "a.csv")
    assert os.listdir(tmp_path) == []
    assert file.read_bytes() == before


def test_the_intact_part_of_a_damaged_recording_is_exported(recorded, tmp_path):
    (tmp_path / "cut.recording").write_bytes(recorded[0].read_bytes()[: -3 * 4096])
    done = pneuforce("export", tmp_path / "cut.recording", tmp_path / "a.csv")
    assert done.returncode == 1
    assert "are intact" in done.stderr
    rows = (tmp_path / "a.csv").read_text().count("\n") - 1
    assert f"{rows} samples" in done.stdout
    assert 0 < rows < recorded[1]["samples"]
