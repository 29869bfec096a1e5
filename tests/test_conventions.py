"""The house rules, held against the code: who imports whom, sizes, docstrings, names, lint and types."""

import ast
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PACKAGES = ("instrument", "page", "registers", "sim", "teststand")
SOURCES = sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))
MOST_LINES, MOST_FUNCTION_LINES = 300, 50
FORBIDDEN_NAMES = {"util", "utils", "helper", "helpers", "manager", "base", "common", "misc"}

CALIBRATION = {"model", "chain", "columns", "contact", "errors", "fifths", "tables", "whole_file"}
VALIDATION = CALIBRATION - {"tables"} | {"calibration", "lag", "tape"}
CONFIG = {"model", "calibration", "chain", "errors", "settings", "tables"}
EVENTS = {
    "commands",
    "coupling",
    "errors",
    "faults",
    "guard",
    "lease",
    "readonly_sqlite",
    "refusal",
    "rig",
    "snapshot",
}
TAPE = {"contact", "core", "coupling", "errors", "faults", "measurement", "readonly_sqlite", "rig"}
#: What a part may import of ours beside itself; "instrument." is left out. The longest prefix says which part
#: a module belongs to, so that "instrument" is what lies in that folder and in none of those named here.
MAY_IMPORT = {
    "instrument": {"model", "rig", "tape"},
    "instrument.__main__": {"cli"},
    "instrument.model": set(),
    "instrument.rig": {"errors"},
    "instrument.calibration": CALIBRATION,
    "instrument.validation": VALIDATION,
    "instrument.config": CONFIG,
    "instrument.doctor": {"core", "faults", "lease", "refusal", "rig"},
    "instrument.events": EVENTS,
    "instrument.tape": TAPE,
    "instrument.cli": {
        "instrument",
        "model",
        "rig",
        "calibration",
        "validation",
        "config",
        "doctor",
        "events",
        "tape",
    }
    | {"registers", "sim", "teststand"},
    "page": {"registers", "errors", "events.words", "tape"},
    "registers": set(),
    "sim": {"sim.published", "rig"},
    "sim.published": {"sim", "model"},
    "teststand": {"registers", "sim", "errors", "faults"},
}
#: The few files that know a library of others.
KNOWN_IN = {
    "pymodbus": ["registers/modbus/client.py"],
    "can": ["registers/can/bus.py", "registers/can/daemon.py", "registers/can/recording.py"],
    "starlette": ["page/answers.py", "page/app.py", "page/guard.py"],
    "uvicorn": ["page/__main__.py", "page/connection.py"],
}

each_source = pytest.mark.parametrize("path", SOURCES, ids=[str(p.relative_to(ROOT)) for p in SOURCES])


def module_of(path):
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@cache
def tree_of(path):
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def imports_of(path):
    return tuple(_imports_of(path))


def _imports_of(path):
    """Dotted names imported anywhere in a file, `from a import b` as a.b where that is a module."""
    for node in ast.walk(tree_of(path)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: imports are absolute here"
            for alias in node.names:
                inner = f"{node.module}.{alias.name}"
                file = ROOT / inner.replace(".", "/")
                yield inner if file.is_dir() or file.with_suffix(".py").exists() else node.module


def within(name, prefixes):
    return any(name == prefix or name.startswith(prefix + ".") for prefix in prefixes)


def part_of(module, parts=tuple(MAY_IMPORT)):
    return max((part for part in parts if within(module, (part,))), key=len)


def allowed(part):
    names = {name if name.split(".")[0] in PACKAGES else f"instrument.{name}" for name in MAY_IMPORT[part]}
    return {part, *names}


@each_source
def test_each_part_imports_only_what_it_may(path):
    may = allowed(part_of(module_of(path)))
    ours = [name for name in imports_of(path) if within(name, PACKAGES)]
    assert [name for name in ours if part_of(name, {*MAY_IMPORT, *may}) not in may] == []


def test_what_a_part_may_import_it_does_import():
    for part in MAY_IMPORT:
        files = [path for path in SOURCES if part_of(module_of(path)) == part]
        seen = {name for path in files for name in imports_of(path) if within(name, PACKAGES)}
        unused = [may for may in allowed(part) - {part} if not any(within(name, (may,)) for name in seen)]
        assert (part, unused) == (part, [])


ROW = re.compile(r"^\| `([a-z/]+)/` \|.*\| ([^|]*) \|$", re.MULTILINE)
ROWS = dict(ROW.findall((ROOT / "docs/house.md").read_text(encoding="utf-8")))
#: Rows of what imports everything, or is no Python.
OPEN_ROWS = {"instrument/cli": "everything", "tests": "everything", "firmware": "nothing"}


def test_each_folder_of_the_instrument_has_a_row_in_the_house():
    folders = {str(path.parent.relative_to(ROOT)) for path in SOURCES}
    assert {folder for folder in folders if folder.split("/")[0] == "instrument" or "/" not in folder} <= set(
        ROWS
    )


@pytest.mark.parametrize("row", ROWS)
def test_the_house_says_what_each_folder_may_import(row):
    if row in OPEN_ROWS:
        assert ROWS[row] == OPEN_ROWS[row]
        return
    told = set(re.findall("`([^`]+)`", ROWS[row].split(";")[0]))
    may = MAY_IMPORT[row.replace("/", ".")] - {"sim.published"}
    assert {name.removeprefix("instrument.") for name in told} == may


@each_source
def test_only_the_command_line_is_imported_by_nobody(path):
    if not within(module_of(path), ("instrument.cli", "instrument.__main__")):
        assert [name for name in imports_of(path) if within(name, ("instrument.cli",))] == []


def test_the_import_table_is_read_from_real_imports():
    assert "instrument.rig.frames" in set(imports_of(ROOT / "instrument/core.py"))
    assert "instrument.model" in set(imports_of(ROOT / "sim/published.py"))


def files_that_import(library):
    return sorted(
        str(path.relative_to(ROOT))
        for path in SOURCES
        if any(within(name, (library,)) for name in imports_of(path))
    )


@pytest.mark.parametrize("library", KNOWN_IN)
def test_a_library_that_changes_its_face_is_imported_where_that_is_said(library):
    assert files_that_import(library) == KNOWN_IN[library]


def test_pyserial_is_imported_in_one_file_of_the_instrument():
    assert [f for f in files_that_import("serial") if f.startswith("instrument")] == [
        "instrument/rig/port.py"
    ]


def test_one_file_of_the_simulator_knows_the_instruments_model():
    sim = [p for p in SOURCES if within(module_of(p), ("sim",))]
    knowing = [p.name for p in sim if any(within(n, ("instrument.model",)) for n in imports_of(p))]
    assert knowing == ["published.py"]


@each_source
def test_no_file_is_longer_than_a_few_screens(path):
    assert len(path.read_text(encoding="utf-8").splitlines()) <= MOST_LINES


def functions_of(path):
    return [n for n in ast.walk(tree_of(path)) if isinstance(n, ast.FunctionDef | ast.AsyncFunctionDef)]


@each_source
def test_every_function_fits_a_screen(path):
    long = {f.name: f.end_lineno - f.lineno + 1 for f in functions_of(path)}
    assert {name: lines for name, lines in long.items() if lines > MOST_FUNCTION_LINES} == {}


def public_members(node, prefix=""):
    for child in node.body:
        if isinstance(child, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            if child.name.startswith("_"):
                continue
            yield f"{prefix}{child.name}", child
            if isinstance(child, ast.ClassDef):
                yield from public_members(child, f"{child.name}.")


@each_source
def test_all_that_is_public_says_what_it_is(path):
    tree = tree_of(path)
    members = [("the module", tree), *public_members(tree)]
    undocumented = [name for name, node in members if not ast.get_docstring(node)]
    assert undocumented == [] or path.read_text() == ""


@each_source
def test_no_file_is_named_after_nothing(path):
    parts = {part for piece in path.relative_to(ROOT).with_suffix("").parts for part in piece.split("_")}
    assert not parts & FORBIDDEN_NAMES


@each_source
def test_units_of_parameters_and_attributes_are_spelt_in_one_way(path):
    wrong = ("_seconds", "_sec", "_ms_", "_millis", "_bar", "_psi", "_newton", "_kPa", "_degrees")
    names = {n.arg for n in ast.walk(tree_of(path)) if isinstance(n, ast.arg)}
    names |= {
        n.target.id
        for n in ast.walk(tree_of(path))
        if isinstance(n, ast.AnnAssign) and isinstance(n.target, ast.Name)
    }
    assert [name for name in names if name.endswith(wrong)] == []


def clean(*command):
    done = subprocess.run(
        [sys.executable, "-m", *command], cwd=ROOT, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_format_is_the_formatters():
    clean("ruff", "format", "--check", ".")


def test_the_linter_has_nothing_to_say():
    clean("ruff", "check", ".")


def test_the_types_are_right():
    clean("mypy")
