"""Tests of the files of the ROS 2 package, without ROS."""

import ast
import configparser
import re
import sys
import tomllib
from pathlib import Path
from xml.etree import ElementTree

from tests.source_tree import ROOT, tree_of

PACKAGE = ROOT / "docs/examples/ros2"
NODE = PACKAGE / "pneuforce_ros/node.py"
LAUNCH = PACKAGE / "launch/pneuforce.launch.py"
MANIFEST = ElementTree.parse(PACKAGE / "package.xml").getroot()
NAME = "pneuforce_ros"


def imported_packages():
    """Return the first names of all imports of the package, except of the standard library."""
    found = set()
    for path in [LAUNCH, *(PACKAGE / NAME).glob("*.py")]:
        for node in ast.walk(tree_of(path)):
            if isinstance(node, ast.Import):
                found |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                found.add(node.module.partition(".")[0])
    return found - sys.stdlib_module_names


def declared_parameters():
    """Return name and default of each parameter that the node declares."""
    return {
        call.args[0].value: call.args[1].value
        for call in ast.walk(tree_of(NODE))
        if isinstance(call, ast.Call)
        and isinstance(call.func, ast.Attribute)
        and call.func.attr in ("_read_only", "_declare_number")
    }


def launch_arguments():
    """Return name and default of each argument of the launch file, with its type."""
    (table,) = (
        node.value
        for node in tree_of(LAUNCH).body
        if isinstance(node, ast.Assign) and node.targets[0].id == "ARGUMENTS"
    )
    kinds = {"str": str, "float": float, "bool": lambda text: text == "true"}
    return {row.elts[0].value: kinds[row.elts[1].id](row.elts[2].value) for row in table.elts}


def keywords_of_setup():
    (call,) = (n for n in ast.walk(tree_of(PACKAGE / "setup.py")) if isinstance(n, ast.Call))
    return {keyword.arg: ast.literal_eval(keyword.value) for keyword in call.keywords}


def test_the_manifest_names_each_imported_package():
    depends = {element.text for element in MANIFEST.iter("exec_depend")}
    assert depends == imported_packages() - {"pneuforce", NAME}


def test_manifest_setup_and_project_agree():
    setup = keywords_of_setup()
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    assert (MANIFEST.findtext("name"), setup["name"]) == (NAME, NAME)
    assert (MANIFEST.findtext("version"), setup["version"]) == (version, version)
    assert MANIFEST.findtext("export/build_type") == "ament_python"


def test_setup_installs_files_that_exist():
    files = [name for _, names in keywords_of_setup()["data_files"] for name in names]
    assert [name for name in files if not (PACKAGE / name).is_file()] == []
    assert LAUNCH.relative_to(PACKAGE).as_posix() in files


def test_the_program_is_installed_where_ros2_run_looks_for_it():
    (script,) = keywords_of_setup()["entry_points"]["console_scripts"]
    module, function = script.partition(" = ")[2].split(":")
    tree = tree_of(PACKAGE / Path(*module.split(".")).with_suffix(".py"))
    assert function in {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
    settings = configparser.ConfigParser(interpolation=None)
    settings.read(PACKAGE / "setup.cfg")
    assert settings["install"]["install_scripts"] == f"$base/lib/{NAME}"


def test_launch_file_and_document_list_the_parameters_of_the_node():
    parameters = declared_parameters()
    assert launch_arguments() == parameters
    text = (ROOT / "docs/how-to/ros2.md").read_text(encoding="utf-8")
    section = text.partition("## Parameters")[2].partition("\n## ")[0]
    documented = dict(re.findall(r"^\| `(\w+)` \| `([^`]+)` \|", section, re.MULTILINE))
    assert documented == {
        name: str(value).lower() if isinstance(value, bool) else str(value)
        for name, value in parameters.items()
    }
