"""Lists of components (SBOM, CycloneDX) of wheel and Debian package: `python -m release.sbom PACKAGE`.

cyclonedx-py lists the Python libraries in the package. The wheel has the same libraries. This module adds the
parts that are in no Python package: the library that draws the plots of the web page, and the firmware of the
board. Each list is checked against the schema of CycloneDX.
"""

from __future__ import annotations

import hashlib
import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
VENDORED = ROOT / "web/static/vendor"
FIRMWARE = ROOT / "firmware/pneuforce.hex"
SCHEMA = "1.6"

Component = dict[str, Any]


def added_components(version: str) -> list[Component]:
    """Return the components that are in no Python package, for a version of the product."""
    readme = (VENDORED / "README.md").read_text(encoding="utf-8")
    (uplot,) = re.findall(r"^uPlot (\S+) draws", readme, re.MULTILINE)
    return [
        {
            "bom-ref": f"pkg:npm/uplot@{uplot}",
            "type": "library",
            "name": "uplot",
            "version": uplot,
            "description": "Plots of the web page, in pneuforce/web/static/vendor",
            "licenses": [{"license": {"id": "MIT"}}],
            "purl": f"pkg:npm/uplot@{uplot}",
            "hashes": [_sha256_of(VENDORED / "uPlot.esm.js")],
        },
        {
            "bom-ref": "pneuforce-firmware",
            "type": "firmware",
            "name": "pneuforce-firmware",
            "version": version,
            "description": "Program of the Arduino UNO, pneuforce/firmware/pneuforce.hex",
            "licenses": [{"license": {"id": "MIT"}}],
            "hashes": [_sha256_of(FIRMWARE)],
        },
    ]


def _sha256_of(file: Path) -> dict[str, str]:
    return {"alg": "SHA-256", "content": hashlib.sha256(file.read_bytes()).hexdigest()}


def complete(document: dict[str, Any]) -> dict[str, Any]:
    """Return a list of components with the added ones, on which the product depends.

    The entry of the product itself is removed from the components, because it is the subject of the list.
    """
    subject = document["metadata"]["component"]
    added = added_components(subject["version"])
    components = [c for c in document["components"] if c["name"] != subject["name"]] + added
    known = {subject["bom-ref"], *(c["bom-ref"] for c in components)}
    edges = {
        d["ref"]: set(d.get("dependsOn", [])) & known for d in document["dependencies"] if d["ref"] in known
    }
    edges[subject["bom-ref"]] = edges.get(subject["bom-ref"], set()) | {c["bom-ref"] for c in added}
    for component in added:
        edges[component["bom-ref"]] = set()
    dependencies = [{"ref": ref, "dependsOn": sorted(edges[ref])} for ref in sorted(edges)]
    return {**document, "components": components, "dependencies": dependencies}


def for_package(document: dict[str, Any], package: str) -> dict[str, Any]:
    """Return a list of components whose subject is a Debian package, named as pneuforce_0.1.0-1_amd64.deb."""
    name, version, architecture = package.removesuffix(".deb").split("_")
    subject = {**document["metadata"]["component"], "purl": f"pkg:deb/{name}@{version}?arch={architecture}"}
    return {**document, "metadata": {**document["metadata"], "component": subject}}


def listed(package: Path) -> dict[str, Any]:
    """Return the list that cyclonedx-py makes of the environment in a Debian package."""
    tool = Path(sys.executable).with_name("cyclonedx-py")
    options = ("--pyproject", ROOT / "pyproject.toml", "--mc-type", "application", "--output-reproducible")
    form = ("--spec-version", SCHEMA, "--output-format", "JSON", "--output-file", "-")
    with tempfile.TemporaryDirectory(prefix="pneuforce-") as folder:
        subprocess.run(["dpkg-deb", "--extract", package, folder], check=True)
        python = Path(folder) / "opt/pneuforce/bin/python"
        done = subprocess.run(
            [tool, "environment", *options, *form, python], check=True, stdout=subprocess.PIPE
        )
    document: dict[str, Any] = json.loads(done.stdout)
    return document


def check(text: str) -> None:
    """Exit with a message if a list does not match the schema of CycloneDX."""
    from cyclonedx.schema import SchemaVersion
    from cyclonedx.validation.json import JsonStrictValidator

    if error := JsonStrictValidator(SchemaVersion.from_version(SCHEMA)).validate_str(text):
        sys.exit(f"the list of components does not match the schema of CycloneDX {SCHEMA}: {error}")


def main() -> None:
    """Write the lists of the package of the command line and of its wheel, next to the package."""
    package = Path(sys.argv[1])
    document = complete(listed(package))
    version = document["metadata"]["component"]["version"]
    lists = {f"pneuforce-{version}": document, package.stem: for_package(document, package.name)}
    for name, content in lists.items():
        text = json.dumps(content, indent=2, ensure_ascii=False) + "\n"
        check(text)
        file = package.with_name(f"{name}.cdx.json")
        file.write_text(text, encoding="utf-8")
        print(file)


if __name__ == "__main__":
    main()
