"""Programs that others wrote and that tests run: skipped by name where they are missing, but never in CI."""

import os
import shutil
from pathlib import Path

import pytest


def needs(package, *shown_by):
    """A mark: without the Debian package these tests are skipped, in CI they run and fail.

    It is there where its program is, or the files that show it.
    """
    there = all(Path(path).exists() for path in shown_by) if shown_by else shutil.which(package)
    missing = not there and not os.environ.get("CI")
    return pytest.mark.skipif(missing, reason=f"{package} is missing: apt-get install {package}")
