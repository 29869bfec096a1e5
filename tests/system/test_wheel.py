"""Tests of the wheel, installed without a clone and without a compiler for the board."""

import json
import os
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path
from urllib.request import urlopen

import pytest

from pneuforce.instrument.cli.files import FILES
from release.reproducible_wheel import rewrite
from tests.source_tree import PARTS, ROOT
from tests.tools import needs

UPLOT = ("LICENSE", "uPlot.esm.js", "uPlot.min.css")
OF_GCC = ("gcc", "as", "ld")

HOLD_PROGRAM = """
from pneuforce.sim.avr.board import AvrBoard
from tests.sim.conftest import Bench
bench = Bench(AvrBoard()).holding()
print(round(bench.pressure_kpa, 1), AvrBoard.__init__.__code__.co_filename)
"""


def run(*command, **more):
    done = subprocess.run(command, capture_output=True, text=True, check=False, **more)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


PIP = (sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet")
COMMIT_S = 1_795_000_000  # stands for the time of the last commit


def build(source, folder="dist"):
    """Return the command that builds a wheel without network access."""
    return (*PIP, "wheel", "--no-build-isolation", "--no-deps", "--wheel-dir", source / folder, source)


def copy_of_the_source(source):
    """Copy the source tree to a folder, because setuptools writes files into the tree."""
    for name in ("pneuforce", "release", *PARTS):
        generated = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / name, source / name, symlinks=True, ignore=generated)
    for name in ("pyproject.toml", "MANIFEST.in", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, source)


def built_in(source):
    """Build the wheel of a copy of the source tree as `make wheel` does, and return its path."""
    copy_of_the_source(source)
    run(*build(source))
    (wheel,) = (source / "dist").glob("pneuforce-*.whl")
    rewrite(wheel, COMMIT_S)
    return wheel


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    return built_in(tmp_path_factory.mktemp("source"))


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory):
    """Return a new virtual environment with the wheel and its libraries, but without the clone."""
    environment = tmp_path_factory.mktemp("installed")
    run(sys.executable, "-m", "venv", "--without-pip", environment)
    run(*PIP, "--python", environment / "bin/python", "install", "--no-deps", wheel)
    (site,) = environment.glob("lib/python*/site-packages")
    (site / "libraries.pth").write_text(sysconfig.get_path("purelib"))
    return environment


@pytest.fixture
def elsewhere(tmp_path):
    """Return a folder, and an environment with a compiler for this machine but without avr-gcc."""
    (tmp_path / "bin").mkdir()
    for name in OF_GCC:
        if found := shutil.which(name):
            (tmp_path / "bin" / name).symlink_to(found)
    return {
        "cwd": tmp_path,
        "env": {**os.environ, "PATH": f"{tmp_path}/bin", "XDG_CACHE_HOME": str(tmp_path)},
    }


def files_of(wheel):
    """Return the sorted names of the files in a wheel."""
    with zipfile.ZipFile(wheel) as archive:
        return sorted(name for name in archive.namelist() if not name.endswith("/"))


def data_in(folder):
    """Return the content of the files of a folder that are not Python files."""
    files = [path for path in folder.rglob("*") if path.is_file() and "__pycache__" not in path.parts]
    return {path.relative_to(folder): path.read_bytes() for path in files if path.suffix != ".py"}


def test_the_same_source_gives_the_same_bytes_in_another_folder_with_another_time_and_umask(wheel, tmp_path):
    umask = os.umask(0o077)
    try:
        again = built_in(tmp_path / "another")
    finally:
        os.umask(umask)
    assert again.read_bytes() == wheel.read_bytes()


def test_two_builds_at_the_same_time_succeed_and_contain_no_file_of_an_earlier_build(wheel, tmp_path):
    copy_of_the_source(tmp_path)
    (tmp_path / "support/deleted.py").touch()
    run(*build(tmp_path))
    (tmp_path / "support/deleted.py").unlink()
    builds = [subprocess.Popen(build(tmp_path, folder)) for folder in ("first", "second")]
    assert [each.wait() for each in builds] == [0, 0]
    for folder in ("first", "second"):
        (built,) = (tmp_path / folder).glob("*.whl")
        assert files_of(built) == files_of(wheel)


def test_nothing_but_pneuforce_is_installed(installed):
    (site,) = installed.glob("lib/python*/site-packages")
    found = {path.name for path in site.iterdir() if not path.name.endswith((".dist-info", ".pth"))}
    assert found == {"pneuforce"}


@pytest.mark.parametrize("package", PARTS)
def test_all_data_files_are_in_the_wheel(installed, package):
    (folder,) = installed.glob(f"lib/python*/site-packages/pneuforce/{package}")
    assert data_in(folder) == data_in(ROOT / package)


def test_the_program_starts_in_an_empty_folder_and_prints_its_version(installed, elsewhere):
    project = (ROOT / "pyproject.toml").read_text()
    version = run(installed / "bin/pneuforce", "--version", **elsewhere).split()[-1]
    assert f'\nversion = "{version}"\n' in project


@pytest.mark.parametrize("name", FILES)
def test_the_files_to_install_are_printed_by_the_program(installed, elsewhere, name):
    printed = run(installed / "bin/pneuforce", "files", name, **elsewhere)
    assert printed == (ROOT / "instrument/deploy" / name).read_text()


def test_the_web_page_of_the_wheel_is_served_with_its_plots(installed, elsewhere):
    options = {"socket": "nobody.sock", "host": "127.0.0.1", "port": 0, "allow": []}
    page = subprocess.Popen(
        (installed / "bin/python", "-P", "-m", "pneuforce.web"),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        **elsewhere,
    )
    with page:
        page.stdin.write(json.dumps(options) + "\n")
        page.stdin.flush()
        at = f"http://127.0.0.1:{json.loads(page.stdout.readline())['port']}"
        served = {name: urlopen(f"{at}/static/vendor/{name}").read() for name in UPLOT}
        index = urlopen(at).read()
        page.stdin.close()
    (static,) = installed.glob("lib/python*/site-packages/pneuforce/web/static")
    assert served == {name: (static / "vendor" / name).read_bytes() for name in UPLOT}
    assert index == (static / "index.html").read_bytes()
    assert page.returncode == 0


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
    said = run(installed / "bin/python", "-c", HOLD_PROGRAM, cwd=elsewhere["cwd"], env=tests)
    pressure_kpa, ran = said.split()
    assert float(pressure_kpa) == pytest.approx(8.0, abs=0.1)
    assert Path(ran).is_relative_to(installed)
