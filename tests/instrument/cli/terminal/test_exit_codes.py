"""Tests of the exit codes: the table in the document, the systemd unit, and the code of each failure."""

import re
import socket
import subprocess
import sys
from typing import get_type_hints

import pytest

from pneuforce import errors
from pneuforce.errors import PneuforceError
from pneuforce.instrument.cli.app import config, run
from pneuforce.instrument.cli.files import FOLDER
from pneuforce.instrument.cli.overview import overview
from pneuforce.instrument.cli.terminal.exit_codes import MEANINGS, ExitCode, exit_code_of
from tests.command_runner import pneuforce
from tests.instrument.recording.recording_files import make_recording
from tests.source_tree import ROOT

ERRORS = [
    each for each in vars(errors).values() if isinstance(each, type) and issubclass(each, PneuforceError)
]


def test_the_document_contains_each_code_and_its_meaning():
    page = (ROOT / "docs/how-to/command-line.md").read_text(encoding="utf-8")
    listed = {int(code): text for code, text in re.findall(r"^\| (\d+) \| (.*) \|$", page, re.MULTILINE)}
    assert listed == {int(code): MEANINGS[code] for code in ExitCode}


def test_each_class_of_errors_has_its_own_code():
    general = {each.__name__ for each in ERRORS if exit_code_of(each.__new__(each)) is ExitCode.FAILED}
    assert general == {"PneuforceError", "ClientError", "InvalidForce", "OtherRegisterMap"}
    assert exit_code_of(OSError()) is ExitCode.IO_ERROR


def test_systemd_does_not_restart_an_instrument_with_an_invalid_configuration():
    unit = (FOLDER / "pneuforce.service").read_text(encoding="utf-8")
    assert re.findall("^RestartPreventExitStatus=(.*)$", unit, re.MULTILINE) == [str(ExitCode.CONFIGURATION)]


def test_the_command_line_leaves_an_unreadable_file_of_the_service_to_the_program():
    """The check of the command line would give exit code 2, after which systemd starts the service again."""
    files = {
        (command.__name__, name): hint.__metadata__[0].readable
        for command in (run, config, overview)
        for name, hint in get_type_hints(command, include_extras=True).items()
        if name in ("config", "check", "require_signed_by", "configurations")
    }
    assert len(files) == 5
    assert not any(files.values())


@pytest.mark.parametrize(
    ("words", "missing"),
    [
        ("plot a.recording a.png", "matplotlib"),
        (f"validate --data {ROOT}/docs/examples/validation-recording.csv --figures figures", "matplotlib"),
        ("export a.recording a.parquet", "pyarrow"),
        ("sign new-key lab.key --signer lab --no-passphrase", "ssh-keygen"),
    ],
)
def test_a_missing_library_or_program_has_its_own_code_and_is_named(tmp_path, words, missing):
    """The library is hidden from the real command, and PATH contains no program."""
    program = (
        f"import sys; sys.modules[{missing!r}] = None; sys.argv = ['pneuforce', *sys.argv[1:]]; "
        "from pneuforce.instrument.cli import main; main()"
    )
    make_recording(tmp_path / "a.recording", 100)
    done = subprocess.run(
        [sys.executable, "-c", program, *words.split()],
        cwd=tmp_path,
        env={"PATH": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert (done.returncode, missing in done.stderr) == (72, True), done.stderr


@pytest.mark.parametrize(
    ("words", "code"),
    [
        ("--version", ExitCode.DONE),
        ("estimate --dpi 8", ExitCode.USAGE),
        ("estimate --dpi 8 --dpf 7", ExitCode.USAGE),
        ("log verify nothing.sqlite", ExitCode.USAGE),
        ("run --config {folder}/missing.toml", ExitCode.CONFIGURATION),
        ("run --config {folder}/invalid.toml", ExitCode.CONFIGURATION),
        ("run --config {folder}", ExitCode.CONFIGURATION),
        ("config --check {folder}", ExitCode.CONFIGURATION),
        ("run --config {folder}/uncalibrated.toml", ExitCode.CONFIGURATION),
        ("log show --config {folder}/invalid.toml", ExitCode.CONFIGURATION),
        ("run --config {folder}/foreign-log.toml", ExitCode.CONFIGURATION),
        ("run --config {folder}/no-rig.toml", ExitCode.UNAVAILABLE),
        ("watch modbus --port 1", ExitCode.UNAVAILABLE),
        ("sim fault leak --control 1", ExitCode.UNAVAILABLE),
        ("hub --port {taken}", ExitCode.UNAVAILABLE),
    ],
)
def test_a_command_exits_with_the_code_of_its_failure(tmp_path, words, code):
    (tmp_path / "invalid.toml").write_text("[modbus]\nport = 70000\n")
    (tmp_path / "uncalibrated.toml").write_text('[measurement]\ncalibration = "missing.toml"\n')
    (tmp_path / "foreign-log.toml").write_text('[events]\nfile = "invalid.toml"\n')
    (tmp_path / "no-rig.toml").write_text(f'[rig]\nport = "{tmp_path}/nothing"\n')
    with socket.create_server(("127.0.0.1", 0)) as server:
        taken = server.getsockname()[1]
        done = pneuforce(*words.format(folder=tmp_path, taken=taken).split(), cwd=tmp_path, timeout_s=600)
    assert (done.returncode, "Traceback" in done.stderr) == (code, False), done.stderr
