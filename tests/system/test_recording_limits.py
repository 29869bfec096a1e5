"""Tests of the conditions that end a recording: its size, the free space of its disk, and a closed stdin."""

import json
import math
import shutil
import subprocess
import sys
from threading import Event

import pytest

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.recording.limits import RecordingLimits
from pneuforce.instrument.recording.schema import EndReason
from pneuforce.instrument.service.local_socket.recorder import record_socket
from tests.instrument.recording.recording_files import read_contents
from tests.system.stream_feeder import StreamFeeder
from tests.system.waiting import wait_for


@pytest.fixture
def feeder(tmp_path):
    with StreamFeeder(tmp_path / "feeder.sock") as running:
        yield running


def test_a_recording_ends_completely_at_its_size_limit(feeder, tmp_path):
    file = tmp_path / "a.recording"
    result = record_socket(file, feeder.path, Event(), lambda _: None, RecordingLimits(max_bytes=0.3e6))
    assert result.complete
    contents = read_contents(file)
    assert contents.ending.how == EndReason.STOPPED
    assert "0.3 MB" in contents.ending.why
    assert contents.ending.samples == len(contents.samples) > 50
    assert file.stat().st_size < 0.6e6


@pytest.mark.parametrize("min_free_bytes", [math.nan, math.inf, 1e15])
def test_a_recording_does_not_start_if_the_disk_is_too_full(tmp_path, min_free_bytes):
    limits = RecordingLimits(min_free_bytes=min_free_bytes)
    with pytest.raises(ConfigurationError, match=r"\d+ MB of the disk are free"):
        record_socket(tmp_path / "a.recording", tmp_path / "no.sock", Event(), lambda _: None, limits)
    assert not (tmp_path / "a.recording").exists()


def test_a_recording_ends_when_too_little_of_the_disk_is_free(tmp_path):
    free_bytes = shutil.disk_usage(tmp_path).free
    assert RecordingLimits(min_free_bytes=free_bytes + 1e9).reached(tmp_path, 1000)
    assert not RecordingLimits(min_free_bytes=free_bytes / 2).reached(tmp_path, 1000)


def test_a_recording_ends_when_the_program_that_started_it_ends(feeder, tmp_path):
    file = tmp_path / "a.recording"
    words = ["record", str(file), "--socket", str(feeder.path), "--json", "--until-stdin-closes"]
    process = subprocess.Popen(
        [sys.executable, "-P", "-m", "pneuforce", *words], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    wait_for(lambda: _samples_in(file), bool)
    process.stdin.close()
    assert process.wait(60) == 0
    assert json.loads(process.stdout.read())["ended"] == EndReason.STOPPED
    assert read_contents(file).ending.how == EndReason.STOPPED


def _samples_in(file):
    try:
        return len(read_contents(file).samples)
    except ConfigurationError:  # no header yet
        return 0
