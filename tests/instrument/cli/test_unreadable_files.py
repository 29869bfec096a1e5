"""Tests of files that the user of a command cannot read: the message contains the remedy."""

import os
import shutil
import subprocess
import sys

import pytest

from pneuforce.instrument.cli.terminal.exit_codes import ExitCode
from tests.source_tree import ROOT

#: Words before a command that remove the rights of root to read all files.
AS_USER = ("setpriv", "--bounding-set=-all", "--inh-caps=-all") if os.geteuid() == 0 else ()
NEEDS_SETPRIV = pytest.mark.skipif(bool(AS_USER) and not shutil.which("setpriv"), reason="setpriv is missing")
PROFILE = """\
doc = "A recorded force."
[[phase]]
setpoint_kpa = 8.0
[[phase.contact]]
kind = "profile"
file = "secret.file"
"""


def run(folder, *words):
    command = [*AS_USER, sys.executable, "-m", "pneuforce", *words]
    return subprocess.run(command, capture_output=True, text=True, cwd=folder, timeout=600, check=False)


@NEEDS_SETPRIV
@pytest.mark.parametrize(
    ("words", "code"),
    [
        ("evaluate secret.file", ExitCode.USAGE),
        ("export secret.file out.csv", ExitCode.USAGE),
        ("replay secret.file", ExitCode.USAGE),
        ("plot secret.file out.png", ExitCode.USAGE),
        ("estimate --csv secret.file", ExitCode.USAGE),
        ("estimate --dpi 8 --dpf 9 --calibration secret.file", ExitCode.USAGE),
        ("validate --data secret.file", ExitCode.USAGE),
        ("validate --config secret.file", ExitCode.USAGE),
        ("calibrate radius secret.file", ExitCode.USAGE),
        ("sim run --scenario ./secret.file", ExitCode.USAGE),
        ("sim run --scenario ./profile.toml", ExitCode.USAGE),
        ("config --check secret.file", ExitCode.CONFIGURATION),
        ("run --config secret.file", ExitCode.CONFIGURATION),
    ],
)
def test_an_unreadable_file_is_reported_with_the_remedy(tmp_path, words, code):
    secret = tmp_path / "secret.file"
    shutil.copy(ROOT / "docs/examples/reference-contacts.csv", secret)
    (tmp_path / "profile.toml").write_text(PROFILE)
    secret.chmod(0)
    done = run(tmp_path, *words.split())
    assert done.returncode == code, done.stderr
    (line,) = done.stderr.splitlines()
    assert f" cannot read {secret}: chgrp " in line
    assert f" && chmod g+r {secret}" in line
