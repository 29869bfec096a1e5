"""Python sources of the project as syntax trees, for the tests of conventions and architecture."""

import ast
import io
import tokenize
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[1]
#: Folders of the repository that are installed below `pneuforce`. Links in pneuforce/ point to them.
PARTS = (
    "client",
    "firmware",
    "instrument",
    "mqtt",
    "protocol",
    "registers",
    "sim",
    "support",
    "teststand",
    "web",
)


def python_files(*folders):
    """Return the Python files below folders of the repository. Links are not followed."""
    return sorted(path for folder in folders for path in (ROOT / folder).rglob("*.py"))


PRODUCT = [*sorted((ROOT / "pneuforce").glob("*.py")), *python_files(*PARTS)]
RELEASE = python_files("release")
TESTS = python_files("tests")
EXAMPLES = python_files("docs/examples")


def name_of(path):
    """Return a path relative to the repository, for messages."""
    return str(path.relative_to(ROOT))


@cache
def tree_of(path):
    """Return the syntax tree of a file."""
    return ast.parse(path.read_text(encoding="utf-8"))


def functions_of(path):
    """Return all functions and methods of a file."""
    return [n for n in ast.walk(tree_of(path)) if isinstance(n, ast.FunctionDef | ast.AsyncFunctionDef)]


def classes_of(path):
    """Return all classes of a file."""
    return [n for n in ast.walk(tree_of(path)) if isinstance(n, ast.ClassDef)]


def docstrings_of(path):
    """Yield line number and text of each docstring."""
    for node in ast.walk(tree_of(path)):
        documented = isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef)
        if documented and (text := ast.get_docstring(node)):
            yield node.body[0].lineno, text


def comments_of(path):
    """Yield line number and text of each comment."""
    with io.StringIO(path.read_text(encoding="utf-8")) as source:
        for token in tokenize.generate_tokens(source.readline):
            if token.type == tokenize.COMMENT:
                yield token.start[0], token.string


def module_of(path):
    """Return the dotted name under which a file of the product is imported."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    parts = parts if parts[0] == "pneuforce" else ("pneuforce", *parts)
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@cache
def modules():
    """Return the file of each module of the product."""
    return {module_of(path): path for path in PRODUCT}


@cache
def imports_of(module):
    """Return all modules that a module imports, including those under TYPE_CHECKING and in functions."""
    found = set()
    for node in ast.walk(tree_of(modules()[module])):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{module}: imports are absolute in this project"
            for alias in node.names:
                full = f"{node.module}.{alias.name}"
                found.add(full if full in modules() else node.module)
    return frozenset(found)
