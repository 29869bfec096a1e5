"""Tests of the check of the libraries of the web server."""

import re
import tomllib

import pytest

from pneuforce.instrument.service.processes.web_libraries import TESTED, installed_versions, untested
from tests.source_tree import ROOT


def test_the_oldest_tested_version_is_the_oldest_that_can_be_installed():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    for name, (oldest, _) in TESTED.items():
        assert f"{name}>={oldest}" in project["dependencies"]


def test_the_installed_versions_are_found():
    assert all(re.match(r"\d+\.\d+", number) for number in installed_versions().values())


@pytest.mark.parametrize(
    ("starlette", "uvicorn", "named"),
    [
        ("1.0.0", "0.40.0", []),
        ("1.10.3", "0.54.9", []),
        ("1.11.0", "0.54.0", ["starlette"]),
        ("1.10.0", "0.55.0rc1", ["uvicorn"]),
        ("0.52.1", "1.0.0", ["starlette", "uvicorn"]),
        ("1.10.0", "", ["uvicorn"]),
    ],
)
def test_an_untested_version_is_named(starlette, uvicorn, named):
    versions = {"starlette": starlette, "uvicorn": uvicorn}
    sentences = untested(versions)
    assert [next(name for name in TESTED if f"install {name}==" in text) for text in sentences] == named
    assert all(versions[name] in text for name, text in zip(named, sentences, strict=True))
