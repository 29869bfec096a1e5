"""Test that the Debian package with its libraries has the same bytes if it is built again."""

import hashlib
import os
import subprocess
import sys

import pytest

from tests.source_tree import ROOT

pytestmark = pytest.mark.slow


def test_a_second_build_in_another_folder_with_another_umask_gives_the_same_bytes(tmp_path):
    (wheel,) = (ROOT / "build/wheel").glob("*.whl")
    (tmp_path / "temporary").mkdir()
    command = [
        sys.executable,
        "-m",
        "release.debian_package",
        wheel,
        "--lock",
        "requirements.lock",
        "--output",
    ]
    subprocess.run(
        [*command, tmp_path],
        cwd=ROOT,
        env={**os.environ, "TMPDIR": f"{tmp_path}/temporary"},
        umask=0o077,
        check=True,
    )
    (again,) = tmp_path.glob("*.deb")
    first = ROOT / "dist" / again.name
    assert hashlib.sha256(again.read_bytes()).digest() == hashlib.sha256(first.read_bytes()).digest()
