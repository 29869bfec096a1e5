"""The wheel, installed where there is neither a clone nor a compiler of the board's."""

import os
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

from tests.tools import needs

ROOT = Path(__file__).parents[2]
PACKAGES = ("firmware", "instrument", "registers", "sim", "teststand")
OF_GCC = ("gcc", "as", "ld")

HOLDS = """
from sim.avr.board import AvrBoard
from tests.sim.conftest import Bench
bench = Bench(AvrBoard()).holding()
print(round(bench.pressure_kpa, 1), AvrBoard.__init__.__code__.co_filename)
"""


def run(*command, **more):
    done = subprocess.run(command, capture_output=True, text=True, check=False, **more)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """A new virtual environment that has the wheel, and our libraries without our clone."""
    source, place = (tmp_path_factory.mktemp(name) for name in ("source", "installed"))
    for name in PACKAGES:  # setuptools leaves files beside what it builds
        shutil.copytree(ROOT / name, source / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, source)
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet")
    run(*pip, "wheel", "--no-build-isolation", "--no-deps", "--wheel-dir", source / "dist", source)
    (wheel,) = (source / "dist").glob("pneuforce-*.whl")
    run(sys.executable, "-m", "venv", "--without-pip", place)
    run(*pip, "--python", place / "bin/python", "install", "--no-deps", wheel)
    (site,) = place.glob("lib/python*/site-packages")
    (site / "libraries.pth").write_text(sysconfig.get_path("purelib"))
    return place


@pytest.fixture
def elsewhere(tmp_path):
    """Another folder, where of all programs only a compiler for this machine is found."""
    (tmp_path / "bin").mkdir()
    for name in OF_GCC:
        if found := shutil.which(name):
            (tmp_path / "bin" / name).symlink_to(found)
    return {
        "cwd": tmp_path,
        "env": {**os.environ, "PATH": f"{tmp_path}/bin", "XDG_CACHE_HOME": str(tmp_path)},
    }


def data_in(folder):
    """Files of a folder that are not Python's."""
    files = [path for path in folder.rglob("*") if path.is_file() and "__pycache__" not in path.parts]
    return {path.relative_to(folder): path.read_bytes() for path in files if path.suffix != ".py"}


@pytest.mark.parametrize("package", PACKAGES)
def test_all_that_lies_beside_the_code_is_in_the_wheel(installed, package):
    (folder,) = installed.glob(f"lib/python*/site-packages/{package}")
    assert data_in(folder) == data_in(ROOT / package)


def test_the_board_is_flashed_with_the_program_of_the_wheel(installed, elsewhere):
    pneuforce = installed / "bin/pneuforce"
    assert "Arduino UNO" in run(pneuforce, "flash", "--help", **elsewhere)
    made_from, command = run(
        pneuforce, "flash", "--port", "/dev/ttyACM0", "--dry-run", **elsewhere
    ).splitlines()
    sketch, program = Path(made_from.split()[-1]), Path(command.split(":")[-2])
    for path in (sketch, program):
        assert path.is_file()
        assert path.is_relative_to(installed)


@needs("gcc")
@needs("libsimavr-dev", "/usr/include/simavr")
def test_the_program_of_the_wheel_runs_on_the_emulated_chip_without_avr_gcc(installed, elsewhere):
    tests = {**elsewhere["env"], "PYTHONPATH": str(elsewhere["cwd"])}
    (elsewhere["cwd"] / "tests").symlink_to(ROOT / "tests")
    said = run(installed / "bin/python", "-c", HOLDS, cwd=elsewhere["cwd"], env=tests)
    pressure_kpa, ran = said.split()
    assert float(pressure_kpa) == pytest.approx(8.0, abs=0.1)
    assert Path(ran).is_relative_to(installed)
