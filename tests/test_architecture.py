"""Tests of the import rules of docs/architecture.md: allowed imports, no cycles, few users of libraries."""

import re
from collections import defaultdict

from tests.source_tree import PARTS, ROOT, imports_of, modules

DOCUMENT = (ROOT / "docs/architecture.md").read_text(encoding="utf-8")
#: Packages in which each module is a separate part, because the modules serve different subpackages.
SPLIT = {"registers", "sim"}
#: A row of the table: part, content, imports.
ROW = re.compile(r"^\| `([\w/]+)` \| .* \| ([^|]*) \|$", re.MULTILINE)
EVERYTHING = "everything"
#: Libraries whose interface changes with minor releases, and the only files that import them.
LIBRARY_USERS = {
    "pymodbus": {"registers/modbus/client.py"},
    "can": {"registers/can/bus.py", "registers/can/log_writer.py", "registers/can/socketcand_bus.py"},
    "prometheus_client": {"web/metrics.py"},
    "aiomqtt": {"mqtt/publisher.py"},
    "google": {"mqtt/payload.py", "mqtt/schema.py"},
    "starlette": {
        "web/app.py",
        "web/health.py",
        "web/server/http_json.py",
        "web/login/login.py",
        "web/login_routes.py",
        "web/overview/server.py",
        "web/plain_http.py",
        "web/plain_page.py",
        "web/recording_routes.py",
        "web/request_guard.py",
        "web/server/request_pacer.py",
        "web/server/web_server.py",
        "web/write_routes.py",
    },
    "uvicorn": {"web/server/connection.py", "web/server/web_server.py"},
    "serial": {"support/serial_port.py", "registers/modbus/rtu_port.py"},
}


def part_of(module):
    """Return the part that a module belongs to: its package, or the module itself in split packages."""
    names = module.split(".")[1:]
    if not names or len(names) == 1:
        return "/".join(names)
    is_package = modules()[module].name == "__init__.py"
    package = names if is_package else names[:-1]
    return "/".join(names if "/".join(package) in SPLIT else package)


def rules():
    """Return the parts that each part may import, as the document lists them."""
    return {part: set(re.findall(r"`([\w/]+)`", allowed)) for part, allowed in ROW.findall(DOCUMENT)}


def own_imports(module):
    return {name for name in imports_of(module) if name in modules()}


def imported_parts():
    found = defaultdict(set)
    for module, path in modules().items():
        if path.name == "__init__.py" and not own_imports(module):
            continue  # a docstring only
        found[part_of(module)] |= {part_of(name) for name in own_imports(module)} - {part_of(module)}
    return {part: imports - {""} for part, imports in found.items() if part}


def cycles(graph):
    """Return each node that can be reached from itself."""

    def reached(start):
        seen, waiting = set(), list(graph.get(start, ()))
        while waiting:
            node = waiting.pop()
            if node not in seen:
                seen.add(node)
                waiting += graph.get(node, ())
        return seen

    return sorted(node for node in graph if node in reached(node))


def test_parts_import_only_what_the_document_allows():
    allowed = rules()
    forbidden = [
        f"{part} imports {other}"
        for part, others in imported_parts().items()
        for other in sorted(others - allowed.get(part, set()))
    ]
    assert forbidden == []


def test_the_document_allows_only_imports_that_exist():
    actual = imported_parts()
    unused = [
        f"{part} does not import {other}"
        for part, others in rules().items()
        for other in sorted(others - actual.get(part, set()))
    ]
    assert unused == []


def test_the_document_lists_each_part_once():
    listed = [part for part, _ in ROW.findall(DOCUMENT)]
    assert sorted(listed) == sorted(imported_parts())


def test_no_modules_import_each_other():
    assert cycles({module: own_imports(module) for module in modules()}) == []


def test_no_parts_import_each_other():
    assert cycles(imported_parts()) == []


def test_a_cycle_is_found():
    assert cycles({"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"a"}}) == ["a", "b", "c"]


def test_type_checking_imports_count():
    assert "pneuforce.instrument.core.state" in imports_of("pneuforce.instrument.core.snapshot")


def test_libraries_with_unstable_interfaces_are_imported_in_few_files():
    users = {library: set() for library in LIBRARY_USERS}
    for module, path in modules().items():
        for library in {name.split(".")[0] for name in imports_of(module)} & users.keys():
            users[library].add(str(path.relative_to(ROOT)))
    assert users == LIBRARY_USERS


def test_each_part_is_linked_into_the_package():
    links = {
        path.name: path.readlink().as_posix() for path in (ROOT / "pneuforce").iterdir() if path.is_symlink()
    }
    assert links == {part: f"../{part}" for part in PARTS}
