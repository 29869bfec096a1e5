"""Tests of the lists of components (SBOM) of the wheel and the Debian package."""

import hashlib
import json
import re

import pytest

from release.sbom import complete, for_package
from tests.source_tree import ROOT

DOCUMENT = {
    "metadata": {"component": {"bom-ref": "root", "name": "pneuforce", "version": "0.1.0"}},
    "components": [
        {"bom-ref": "pneuforce==0.1.0", "name": "pneuforce"},
        {"bom-ref": "numpy", "name": "numpy"},
    ],
    "dependencies": [{"ref": "root", "dependsOn": ["numpy"]}, {"ref": "numpy"}],
}


def test_the_plots_and_the_firmware_are_components_on_which_the_product_depends():
    document = complete(DOCUMENT)
    components = {component["name"]: component for component in document["components"]}
    assert components.keys() == {"numpy", "uplot", "pneuforce-firmware"}
    firmware = hashlib.sha256((ROOT / "firmware/pneuforce.hex").read_bytes()).hexdigest()
    assert components["pneuforce-firmware"]["hashes"] == [{"alg": "SHA-256", "content": firmware}]
    assert re.fullmatch(r"pkg:npm/uplot@\d+\.\d+\.\d+", components["uplot"]["purl"])
    needs = {entry["ref"]: entry["dependsOn"] for entry in document["dependencies"]}
    assert needs["root"] == sorted(["numpy", "pneuforce-firmware", components["uplot"]["bom-ref"]])


def test_the_list_of_a_package_names_the_package():
    subject = for_package(complete(DOCUMENT), "pneuforce_0.1.0-1_amd64.deb")["metadata"]["component"]
    assert subject["purl"] == "pkg:deb/pneuforce@0.1.0-1?arch=amd64"


@pytest.mark.slow
def test_the_lists_contain_every_locked_library_and_no_path_of_this_computer():
    lock = (ROOT / "requirements.lock").read_text(encoding="utf-8")
    locked = {name.lower() for name in re.findall(r"(?m)^([\w-]+)==", lock)}
    lists = sorted((ROOT / "dist").glob("*.cdx.json"))
    assert len(lists) >= 2
    for file in lists:
        text = file.read_text(encoding="utf-8")
        found = {component["name"].lower().replace("_", "-") for component in json.loads(text)["components"]}
        assert found == locked | {"uplot", "pneuforce-firmware"}
        assert "file:" not in text
        assert "/tmp" not in text
