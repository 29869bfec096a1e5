"""Tests of the conventions of the code: sizes, names, docstrings, plain words, lint, format and types."""

import ast
import re
import subprocess
import sys
from collections import defaultdict

import pytest

from tests.source_tree import (
    EXAMPLES,
    PRODUCT,
    RELEASE,
    ROOT,
    TESTS,
    classes_of,
    comments_of,
    docstrings_of,
    functions_of,
    name_of,
    tree_of,
)

MAX_LINES, MAX_FUNCTION_LINES = 300, 50
MEANINGLESS_NAMES = {"util", "utils", "helper", "helpers", "manager", "base", "common", "misc"}
WRONG_UNITS = ("_seconds", "_sec", "_ms_", "_millis", "_bar", "_psi", "_newton", "_kPa", "_degrees")
#: First words that a docstring must not have, because such a docstring is a fragment.
FRAGMENT = re.compile(r"(What|Who|Whose|Whether|Where|How|It|That|Those|Nobody)\b")
#: Words that describe a program as a person, or that are unclear. docs/glossary.md has better terms.
UNCLEAR = re.compile(
    r"\b(nobody|whoever|reckon(s|ed|ing)?|is told|are told|was told|believes?|hopes?|owes?|owed|obey(s|ed)?"
    r"|wishes|of ours|none of ours|that is none|anew|nought|hitherto|betwixt)\b",
    re.IGNORECASE,
)
#: Class names that several modules declare, with the reason.
SHARED_CLASS_NAMES: dict[str, str] = {
    "Measurement": "values of a sample: in the measuring chain, and in the Python package for clients",
    "Recording": "file that is open for reading, and its samples in the Python package for clients",
}
DOCUMENTS = [
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    ROOT / "SECURITY.md",
    *sorted((ROOT / "docs").rglob("*.md")),
]
MAX_README_WORDS, MAX_CODE_COLUMNS = 800, 100


def listed(findings):
    """Return all findings as one message."""
    return "\n" + "\n".join(findings)


def test_no_file_is_longer_than_a_few_screens():
    lines = {name_of(path): len(path.read_text(encoding="utf-8").splitlines()) for path in PRODUCT}
    assert {name: count for name, count in lines.items() if count > MAX_LINES} == {}


def test_every_function_fits_a_screen():
    long = [
        f"{name_of(path)}:{function.lineno} {function.name}: {lines} lines"
        for path in PRODUCT
        for function in functions_of(path)
        if (lines := function.end_lineno - function.lineno + 1) > MAX_FUNCTION_LINES
    ]
    assert not long, listed(long)


def test_every_public_name_has_a_docstring():
    """Ruff checks the same, but not in files that its configuration excludes."""
    missing = [
        f"{name_of(path)}: {name}"
        for path in PRODUCT
        for name, node in [("the module", tree_of(path)), *public_members(tree_of(path))]
        if not ast.get_docstring(node)
    ]
    assert not missing, listed(missing)


def public_members(node, prefix=""):
    for child in node.body:
        if isinstance(child, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            is_setter = any(isinstance(d, ast.Attribute) and d.attr == "setter" for d in child.decorator_list)
            is_overload = any(isinstance(d, ast.Name) and d.id == "overload" for d in child.decorator_list)
            if child.name.startswith("_") or is_setter or is_overload:
                continue
            yield f"{prefix}{child.name}", child
            if isinstance(child, ast.ClassDef):
                yield from public_members(child, f"{child.name}.")


def test_no_file_has_a_meaningless_name():
    def words(path):
        return {word for part in path.relative_to(ROOT).with_suffix("").parts for word in part.split("_")}

    assert [name_of(path) for path in PRODUCT if words(path) & MEANINGLESS_NAMES] == []


def test_units_in_names_are_spelled_in_one_way():
    wrong = []
    for path in PRODUCT:
        for node in ast.walk(tree_of(path)):
            name = node.arg if isinstance(node, ast.arg) else ""
            if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
                name = node.target.id
            if name.endswith(WRONG_UNITS):
                wrong.append(f"{name_of(path)}:{node.lineno} {name}")
    assert not wrong, listed(wrong)


def test_public_class_names_are_unique():
    files = defaultdict(list)
    for path in PRODUCT:
        for node in tree_of(path).body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                files[node.name].append(name_of(path))
    shared = {name: paths for name, paths in files.items() if len(paths) > 1}
    assert {name: paths for name, paths in shared.items() if name not in SHARED_CLASS_NAMES} == {}
    assert SHARED_CLASS_NAMES.keys() <= shared.keys()


def test_no_docstring_begins_as_a_fragment():
    found = [
        f"{name_of(path)}:{line} {text.splitlines()[0]}"
        for path in [*PRODUCT, *RELEASE, *TESTS, *EXAMPLES]
        for line, text in docstrings_of(path)
        if FRAGMENT.match(text)
    ]
    assert not found, listed(found)


def test_docstrings_and_comments_use_plain_words():
    found = [
        f"{name_of(path)}:{line} “{word[0]}” in: {text.strip().splitlines()[0]}"
        for path in [*PRODUCT, *RELEASE, *TESTS, *EXAMPLES]
        if path.name != "test_conventions.py"
        for line, text in [*docstrings_of(path), *comments_of(path)]
        if (word := UNCLEAR.search(text))
    ]
    assert not found, listed(found)


def test_documents_use_plain_words():
    found = [
        f"{name_of(path)}:{number} “{word[0]}”"
        for path in DOCUMENTS
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if (word := UNCLEAR.search(line))
    ]
    assert not found, listed(found)


def test_the_readme_is_short():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    prose = re.sub(r"```.*?```", "", text, flags=re.DOTALL)
    assert len(prose.split()) <= MAX_README_WORDS
    code = [line for block in re.findall(r"```.*?```", text, re.DOTALL) for line in block.splitlines()]
    assert [line for line in code if len(line) > MAX_CODE_COLUMNS] == []


@pytest.mark.parametrize(
    "command", [("ruff", "format", "--check", "."), ("ruff", "check", "."), ("mypy",)], ids=" ".join
)
def test_the_linters_find_nothing(command):
    done = subprocess.run(
        [sys.executable, "-m", *command], cwd=ROOT, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_test_functions_are_unique_in_their_file():
    """A second function of the same name would silently replace the first."""
    repeated = []
    for path in TESTS:
        for scope in [tree_of(path), *classes_of(path)]:
            names = [
                n.name for n in scope.body if isinstance(n, ast.FunctionDef) and n.name.startswith("test_")
            ]
            repeated += [f"{name_of(path)}: {name}" for name in sorted(set(names)) if names.count(name) > 1]
    assert not repeated, listed(repeated)
