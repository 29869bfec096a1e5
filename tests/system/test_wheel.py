"""The wheel, installed where there is neither a clone nor a compiler of the board's."""

import json
import os
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path
from urllib.request import urlopen

import pytest

from instrument.cli.files import FILES
from tests.tools import needs

ROOT = Path(__file__).parents[2]
PACKAGES = ("firmware", "instrument", "page", "registers", "sim", "teststand")
#: What npm's files in page/ are for is done when the wheel is built.
WITH_DATA = [name.replace("page", "page/static") for name in PACKAGES]
UPLOT = ("LICENSE", "uPlot.esm.js", "uPlot.min.css")
VENDORED = ROOT / "page/static/vendor"
pytestmark = pytest.mark.skipif(
    not (VENDORED / "uPlot.esm.js").exists() and not os.environ.get("CI"),
    reason="uPlot is missing, and no wheel is built without: make vendor",
)
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


PIP = (sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet")


def build(source):
    """The command that builds a wheel without asking a registry."""
    return (*PIP, "wheel", "--no-build-isolation", "--no-deps", "--wheel-dir", source / "dist", source)


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    """The tree without what was made from it: setuptools leaves files beside what it builds."""
    source = tmp_path_factory.mktemp("source")
    for name in PACKAGES:
        shutil.copytree(ROOT / name, source / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "setup.py", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, source)
    return source


@pytest.fixture(scope="module")
def installed(source, tmp_path_factory):
    """A new virtual environment that has the wheel, and our libraries without our clone."""
    place = tmp_path_factory.mktemp("installed")
    run(*build(source))
    (wheel,) = (source / "dist").glob("pneuforce-*.whl")
    run(sys.executable, "-m", "venv", "--without-pip", place)
    run(*PIP, "--python", place / "bin/python", "install", "--no-deps", wheel)
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


@pytest.mark.parametrize("package", WITH_DATA)
def test_all_that_lies_beside_the_code_is_in_the_wheel(installed, package):
    (folder,) = installed.glob(f"lib/python*/site-packages/{package}")
    assert data_in(folder) == data_in(ROOT / package)


def test_the_program_starts_in_an_empty_folder_and_says_its_version(installed, elsewhere):
    project = (ROOT / "pyproject.toml").read_text()
    version = run(installed / "bin/pneuforce", "--version", **elsewhere).split()[-1]
    assert f'\nversion = "{version}"\n' in project


@pytest.mark.parametrize("name", FILES)
def test_what_is_installed_beside_the_program_is_printed_by_it(installed, elsewhere, name):
    printed = run(installed / "bin/pneuforce", "files", name, **elsewhere)
    assert printed == (ROOT / "instrument/service" / name).read_text()


def test_the_page_of_the_wheel_is_served_with_what_draws_it(installed, elsewhere):
    options = {"socket": "nobody.sock", "host": "127.0.0.1", "port": 0, "allow": [], "token": ""}
    page = subprocess.Popen(
        (installed / "bin/python", "-P", "-m", "page"),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        **elsewhere,
    )
    with page:
        page.stdin.write(json.dumps(options) + "\n")
        page.stdin.flush()
        at = f"http://127.0.0.1:{json.loads(page.stdout.readline())['page']}"
        served = {name: urlopen(f"{at}/static/vendor/{name}").read() for name in UPLOT}
        index = urlopen(at).read()
        page.stdin.close()
    (static,) = installed.glob("lib/python*/site-packages/page/static")
    assert served == {name: (static / "vendor" / name).read_bytes() for name in UPLOT}
    assert index == (static / "index.html").read_bytes()
    assert page.returncode == 0


def test_no_wheel_is_built_whose_page_would_have_no_plots(installed, source):
    shutil.rmtree(source / "page/static/vendor")
    done = subprocess.run(build(source), capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert "lacks uPlot, which draws the page: run make vendor, or make wheel" in done.stdout + done.stderr


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
