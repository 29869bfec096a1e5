"""Programs of Prometheus: installed, or unpacked by `make build/prometheus/installed`."""

import os
import shutil
from pathlib import Path

import pytest

UNPACKED = Path(__file__).parents[1] / "build/prometheus/usr/bin"


def _program(name):
    unpacked = UNPACKED / name
    return str(unpacked) if unpacked.exists() else shutil.which(name)


PROMETHEUS, PROMTOOL = _program("prometheus"), _program("promtool")
NEEDS_PROMETHEUS = pytest.mark.skipif(
    not (PROMETHEUS and PROMTOOL) and not os.environ.get("CI"),
    reason="Prometheus is missing: make build/prometheus/installed",
)
