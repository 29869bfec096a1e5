"""Tests of the Debian package without its libraries: files, fields and maintainer scripts."""

import subprocess
import tomllib

import pytest

from pneuforce.instrument.cli.files import FILES as INSTALLED_FILES
from pneuforce.instrument.config import load
from release.debian_control import SCRIPTS
from release.debian_package import FILES, PYTHON, pack, packaged_files, stage_files, version_of
from tests.source_tree import ROOT
from tests.tools import needs

ONE_MORE_UNIT = "instrument/deploy/pneuforce.service /usr/lib/systemd/system/pneuforce@.service 0644\n"
pytestmark = needs("dpkg, python3", "/usr/bin/dpkg-deb", PYTHON)


@pytest.fixture(scope="module", autouse=True)
def _time():
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SOURCE_DATE_EPOCH", "1700000000")
        yield


def packed(folder, table):
    """Return the package of a table of files, and the folder with its unpacked control files."""
    tree = folder / "tree"
    tree.mkdir()
    files = packaged_files(table)
    stage_files(tree, files)
    package = pack(tree, files, "0.1.0-1", folder / "output")
    subprocess.run(["dpkg-deb", "--control", package, folder / "control"], check=True)
    return package, folder / "control"


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    return packed(tmp_path_factory.mktemp("package"), FILES.read_text(encoding="utf-8"))


def test_the_package_contains_each_file_with_its_mode_and_as_a_file_of_root(package):
    listed = subprocess.run(
        ["dpkg-deb", "--contents", package[0]], capture_output=True, text=True, check=True
    )
    rows = {row.split()[-1]: row.split()[:2] for row in listed.stdout.splitlines()}
    assert rows["./etc/pneuforce/instrument.toml"] == ["-rw-r-----", "root/root"]
    assert rows["./etc/pneuforce/"] == ["drwxr-x---", "root/root"]
    assert rows["./usr/lib/systemd/system/pneuforce.service"] == ["-rw-r--r--", "root/root"]
    assert all(owner == "root/root" for _, owner in rows.values())
    assert {f"./{file.destination}" for file in packaged_files(FILES.read_text())} <= rows.keys()


def test_every_file_that_the_program_prints_is_in_the_package():
    sources = {file.source for file in packaged_files(FILES.read_text())}
    assert {f"instrument/deploy/{name}" for name in INSTALLED_FILES} <= sources


def test_every_document_that_the_messages_name_is_in_the_package():
    sources = {file.source for file in packaged_files(FILES.read_text())}
    documents = {path.relative_to(ROOT).as_posix() for path in (ROOT / "docs").rglob("*.md")}
    assert len(documents) > 40
    assert documents <= sources


def test_the_configuration_is_a_conffile_and_valid(package):
    assert (package[1] / "conffiles").read_text() == "/etc/pneuforce/instrument.toml\n"
    configuration = load(ROOT / "instrument/deploy/service.toml")
    assert configuration.modbus.host == "127.0.0.1"


def test_the_version_and_the_licenses_agree_with_the_project(package):
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    assert version_of(ROOT / f"pneuforce-{version}-py3-none-any.whl", "2") == f"{version}-2"
    assert version_of(ROOT / "pneuforce-0.2.0rc1-py3-none-any.whl", "1") == "0.2.0~rc1-1"
    fields = (package[1] / "control").read_text()
    assert "\nVersion: 0.1.0-1\n" in fields
    assert "python3 (<< 3." in fields


@pytest.mark.parametrize("name", SCRIPTS)
def test_a_maintainer_script_is_valid_and_complete(package, name):
    script = package[1] / name
    subprocess.run(["sh", "-n", script], check=True)
    assert "@UNIT" not in script.read_text()


def test_one_more_unit_is_one_more_line(tmp_path):
    _, control = packed(tmp_path, FILES.read_text() + ONE_MORE_UNIT)
    assert "'pneuforce.service' 'pneuforce@*.service'" in (control / "prerm").read_text()
    assert "*.wants/pneuforce.service *.wants/pneuforce@*.service" in (control / "postrm").read_text()
