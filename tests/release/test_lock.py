"""Tests of requirements.lock: the locked libraries satisfy pyproject.toml and each other on every machine."""

import re
import tomllib
from importlib.metadata import PackageNotFoundError, distribution

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tests.source_tree import ROOT

LOCK = (ROOT / "requirements.lock").read_text(encoding="utf-8")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
MACHINES = [(python, machine) for python in ("3.11", "3.12") for machine in ("x86_64", "aarch64")]
on_each_machine = pytest.mark.parametrize(("python", "machine"), MACHINES)


def environment(python, machine):
    return {
        "python_version": python,
        "python_full_version": f"{python}.0",
        "platform_machine": machine,
        "sys_platform": "linux",
        "platform_system": "Linux",
        "os_name": "posix",
        "platform_python_implementation": "CPython",
        "implementation_name": "cpython",
        "extra": "",
    }


def entries():
    """Return the requirement and the number of hashes of each entry."""
    text = re.sub(r"(?m)^#.*\n", "", LOCK).replace("\\\n", " ")
    rows = [row.partition(" --hash") for row in text.splitlines()]
    return [(Requirement(row[0]), "".join(row).count(" --hash=sha256:")) for row in rows]


def locked_on(where):
    """Return the only version of each library on a machine."""
    chosen = [r for r, _ in entries() if r.marker is None or r.marker.evaluate(where)]
    versions = {canonicalize_name(r.name): str(r.specifier).removeprefix("==") for r in chosen}
    assert len(versions) == len(chosen)
    return versions


def missing_in(versions, requirements, where):
    needed = [r for r in map(Requirement, requirements) if r.marker is None or r.marker.evaluate(where)]
    found = {r: versions.get(canonicalize_name(r.name)) for r in needed}
    return [str(r) for r, version in found.items() if version is None or version not in r.specifier]


@on_each_machine
def test_the_lock_satisfies_the_project(python, machine):
    where = environment(python, machine)
    assert missing_in(locked_on(where), PROJECT["dependencies"], where) == []


@on_each_machine
def test_the_locked_libraries_satisfy_each_other(python, machine):
    """Check the libraries of which the locked version is installed here."""
    where = environment(python, machine)
    versions = locked_on(where)
    missing = {}
    for name, version in versions.items():
        try:
            installed = distribution(name)
        except PackageNotFoundError:
            continue
        if installed.version == version:
            missing[name] = missing_in(versions, installed.requires or [], where)
    assert {name: needs for name, needs in missing.items() if needs} == {}


def test_a_missing_library_is_found():
    where = environment("3.11", "x86_64")
    assert missing_in(
        {"numpy": "1.0"}, ["numpy>=1.26", "scipy", "colorama; sys_platform == 'win32'"], where
    ) == [
        "numpy>=1.26",
        "scipy",
    ]


def test_every_entry_has_hashes_and_none_names_a_registry():
    assert all(hashes for _, hashes in entries())
    assert "://" not in LOCK
    assert "index-url" not in LOCK
