"""Programs that others wrote and that tests run: skipped by name where they are missing, but never in CI."""

import os
import shutil

import pytest


def needs(program):
    """A mark: without the Debian package `program` these tests are skipped, in CI they run and fail."""
    missing = shutil.which(program) is None and not os.environ.get("CI")
    return pytest.mark.skipif(missing, reason=f"{program} is missing: apt-get install {program}")
