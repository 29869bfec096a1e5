"""Third-party programs that tests run. If a program is missing, its tests are skipped, except in CI."""

import os
import shutil
from pathlib import Path

import pytest


def needs(package, *shown_by):
    """Return a mark that skips tests without a Debian package; in CI these tests run and fail.

    A package is installed if the files in `shown_by` exist or, without `shown_by`, if its program exists.
    """
    there = all(Path(path).exists() for path in shown_by) if shown_by else shutil.which(package)
    missing = not there and not os.environ.get("CI")
    return pytest.mark.skipif(missing, reason=f"{package} is missing: apt-get install {package}")
