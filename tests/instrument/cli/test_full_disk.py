"""Tests of commands whose output does not fit on the disk. The exit code is that of an I/O error."""

import resource
import subprocess
import sys

import pytest

from pneuforce.errors import ConfigurationError, WriteFailed
from pneuforce.instrument.cli.terminal.exit_codes import ExitCode
from pneuforce.support.atomic_file import write_lines
from pneuforce.support.write_error import REMEDY, write_error
from tests.instrument.recording.recorded_story import press, record_story
from tests.source_tree import ROOT

LIMIT_BYTES = 200


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    return record_story(tmp_path_factory.mktemp("pressed") / "press.recording", press)


def limit_files():
    """Make each write beyond 200 bytes of a file fail, as on a full disk."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (LIMIT_BYTES, LIMIT_BYTES))


def run(*words, stdout=subprocess.PIPE, **options):
    command = [sys.executable, "-m", "pneuforce", *map(str, words)]
    pipes = {"stdout": stdout, "stderr": subprocess.PIPE}
    return subprocess.run(command, **pipes, text=True, timeout=600, check=False, **options)


@pytest.mark.parametrize(
    "words",
    [
        "export {recording} {out}.csv",
        "export {recording} {out}.parquet",
        "plot {recording} {out}.png",
        "estimate --csv {examples}/reference-contacts.csv --out {out}.csv",
        "calibrate radius {examples}/radius.csv --out {out}.toml",
    ],
)
def test_a_file_that_does_not_fit_on_the_disk_is_an_io_error(recording, tmp_path, words):
    names = {"recording": recording, "examples": ROOT / "docs/examples", "out": tmp_path / "out"}
    done = run(*words.format(**names).split(), preexec_fn=limit_files)
    assert (done.returncode, "Traceback" in done.stderr) == (ExitCode.IO_ERROR, False), done.stderr
    (line,) = done.stderr.splitlines()
    assert line.startswith(f"pneuforce: {tmp_path}/out.")
    assert line.endswith(REMEDY)
    assert list(tmp_path.iterdir()) == []


def test_a_recording_that_cannot_be_created_on_a_full_disk_is_an_io_error(tmp_path):
    program = (
        "import sys; from pathlib import Path\n"
        "from pneuforce.instrument.recording.writer import RecordingWriteError, RecordingWriter\n"
        "try: RecordingWriter(Path(sys.argv[1]))\n"
        "except RecordingWriteError as error: print(error)\n"
    )
    command = [sys.executable, "-c", program, tmp_path / "full.recording"]
    done = subprocess.run(command, preexec_fn=limit_files, capture_output=True, text=True, check=True)
    assert done.stdout.rstrip().endswith(REMEDY)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("words", [("map",), ("config", "--example"), ("files",), ("sim", "run", "--list")])
def test_an_output_that_does_not_fit_on_the_disk_is_an_io_error(words):
    with open("/dev/full", "w") as full:
        done = run(*words, stdout=full)
    why = f"No space left on device: {REMEDY}"
    assert (done.returncode, done.stderr) == (
        ExitCode.IO_ERROR,
        f"pneuforce: the output cannot be written: {why}\n",
    )


def test_a_wrong_name_of_a_file_is_not_an_io_error(tmp_path):
    with pytest.raises(ConfigurationError):
        write_lines(tmp_path / "missing" / "out.csv", ["text"])
    assert isinstance(write_error(tmp_path, OSError(28, "No space left on device")), WriteFailed)
