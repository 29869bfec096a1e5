"""Pytest plugin in the project of a user: with packages of the same names, and with older libraries."""

import os
import re
import subprocess
import sys

import pytest

from pneuforce.teststand.stack import free_port
from tests.source_tree import ROOT

OLDEST = ROOT / "build/oldest"
#: Folders of pneuforce, and names that pneuforce had before, which a user may also have.
OWN_PACKAGES = ("client", "instrument", "page", "protocol", "registers", "sim", "support", "tests", "web")
NEEDS_OLDEST = pytest.mark.skipif(
    not (OLDEST / "pymodbus").exists() and not os.environ.get("CI"),
    reason="old libraries are missing: make build/oldest/installed",
)

WITH_OWN_PACKAGES = f"""
from importlib import import_module

def test_mine(pneuforce_rig):
    names = {OWN_PACKAGES}
    assert [import_module(name).MINE for name in names] == list(names)
    pneuforce_rig.wait_for(lambda registers: registers["state"] == "vented")
    assert pneuforce_rig.truth()["applied_n"] == 0.0
"""

WITH_OLDEST_LIBRARIES = """
from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import version
from urllib.request import Request, urlopen
import can, pymodbus, pytest
from pneuforce.registers.modbus.client import WriteRejectedError
from test_plc_program import Program

WEB = {"enabled": True, "port": PORT}

@pytest.mark.pneuforce(instrument={"web": WEB})
def test_mine(pneuforce_rig):
    libraries = ("prometheus-client", "pymodbus", "python-can", "starlette", "uvicorn")
    print({name: version(name) for name in libraries})
    assert can.__file__.startswith(FOLDER) and pymodbus.__file__.startswith(FOLDER)
    with can.Bus(**pneuforce_rig.can_arguments) as bus:
        pneuforce_rig.inflate(8.0)
        pneuforce_rig.press(2.0)
        assert pneuforce_rig.read()["force"] == pytest.approx(pneuforce_rig.truth()["force_n"], abs=0.3)
        assert bus.recv(1.0) is not None
    with ThreadPoolExecutor() as executor:
        assert executor.submit(pneuforce_rig.read).result()["state"] == "holding"
    program = Program(pneuforce_rig.modbus_port)
    program.cycle()
    assert program.valid and program.force_n > 1.5
    with pytest.raises(WriteRejectedError) as rejected:
        pneuforce_rig.write("setpoint_requested", 12.5)
    assert rejected.value.reason == "illegal value"
    assert urlopen(f"http://127.0.0.1:{WEB['port']}/").status == 200
    for form in ("text/plain", "application/openmetrics-text"):
        request = Request(f"http://127.0.0.1:{WEB['port']}/metrics", headers={"Accept": form})
        answer = urlopen(request)
        assert answer.headers["content-type"].startswith(form)
        assert b"pneuforce_instrument_up 1.0" in answer.read()
"""


def pytest_in(folder, program, **environment):
    """Run pytest on this program in a project that has packages of its own. Return the output."""
    for name in OWN_PACKAGES:
        (folder / name).mkdir()
        (folder / name / "__init__.py").write_text(f"MINE = {name!r}\n")
    (folder / "tests" / "test_mine.py").write_text(program)
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-s", "-p", "no:cacheprovider", "tests"],
        cwd=folder,
        env=os.environ | environment,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_the_packages_of_the_user_and_of_the_instrument_do_not_disturb_each_other(tmp_path):
    pytest_in(tmp_path, WITH_OWN_PACKAGES)


@NEEDS_OLDEST
def test_the_fixture_works_with_the_oldest_libraries(tmp_path):
    program = WITH_OLDEST_LIBRARIES.replace("PORT", str(free_port())).replace("FOLDER", repr(str(OLDEST)))
    output = pytest_in(tmp_path, program, PYTHONPATH=f"{OLDEST}:{ROOT / 'docs/examples'}")
    wanted = re.findall(r"^([\w-]+)==([\d.]+)$", (ROOT / "tests/oldest.txt").read_text(), re.MULTILINE)
    assert str(dict(wanted)) in output


def test_the_oldest_libraries_are_the_oldest_that_can_be_installed():
    project = (ROOT / "pyproject.toml").read_text()
    for name, version in re.findall(
        r"^([\w-]+)==([\d.]+)$", (ROOT / "tests/oldest.txt").read_text(), re.MULTILINE
    ):
        assert f'"{name}>={version.removesuffix(".0")}"' in project
