"""Third-party programs that tests run. Without them a test is skipped, except in CI."""

import os
import shutil
from pathlib import Path

import pytest


def needs(package, *shown_by):
    """Return a mark that skips tests without a Debian package; in CI these tests run and fail.

    The package is installed if its program exists, or the files that `shown_by` lists.
    """
    there = all(Path(path).exists() for path in shown_by) if shown_by else shutil.which(package)
    missing = not there and not os.environ.get("CI")
    return pytest.mark.skipif(missing, reason=f"{package} is missing: apt-get install {package}")
