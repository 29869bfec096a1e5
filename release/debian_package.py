"""Construction of the Debian package: `python -m release.debian_package WHEEL --lock FILE --output FOLDER`.

dpkg-deb packs a staged tree. dpkg-deb is on every Debian, and the package needs no other part of debhelper.
The same sources give the same bytes: the times of the files are SOURCE_DATE_EPOCH, and pip checks the hashes
of the libraries.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

from release.debian_control import control_files

ROOT = Path(__file__).parents[1]
FILES = ROOT / "release/debian/files.txt"
INSTALLED = Path("opt/pneuforce")
#: Python of Debian. Its version is a dependency of the package.
PYTHON = "/usr/bin/python3"
PIP = (sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet")


class PackagedFile(NamedTuple):
    """File of the source tree, its path in the package without the first slash, and its mode."""

    source: str
    destination: str
    mode: int


def packaged_files(table: str) -> list[PackagedFile]:
    """Return the files of a table. A source that ends with a slash stands for all files below this folder."""
    rows = [line.split() for line in table.splitlines() if line and not line.startswith("#")]
    return [
        PackagedFile(source, path.lstrip("/"), int(mode, 8))
        for row in rows
        for source, path, mode in ([row] if not row[0].endswith("/") else _files_below(*row))
    ]


def _files_below(folder: str, destination: str, mode: str) -> list[tuple[str, str, str]]:
    files = sorted(path for path in (ROOT / folder).rglob("*") if path.is_file())
    names = [file.relative_to(ROOT / folder).as_posix() for file in files]
    return [(folder + name, destination + name, mode) for name in names if "__pycache__" not in name]


def stage_files(tree: Path, files: list[PackagedFile]) -> None:
    """Copy files of the source tree into a staged tree, with their modes."""
    for file in files:
        target = tree / file.destination
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes((ROOT / file.source).read_bytes())
        target.chmod(file.mode)


def stage_environment(tree: Path, wheel: Path, lock: Path) -> None:
    """Install the locked libraries and the wheel into a new virtual environment in a staged tree."""
    environment = tree / INSTALLED
    _run(PYTHON, "-m", "venv", "--without-pip", environment)
    install = (*PIP, "--python", environment / "bin/python", "install", "--no-compile")
    _run(*install, "--require-hashes", "--only-binary", ":all:", "-r", lock)
    version = wheel.name.split("-")[1]
    local = ("--no-index", "--find-links", wheel.parent)  # so that pip does not write the path of the wheel
    _run(*install, "--no-deps", *local, f"pneuforce=={version}")
    _move_to_its_place(environment)
    link = tree / "usr/bin/pneuforce"
    link.parent.mkdir(parents=True, exist_ok=True)
    link.symlink_to("/opt/pneuforce/bin/pneuforce")


def _move_to_its_place(environment: Path) -> None:
    """Replace the path of the staged environment by the path after the installation.

    The lists of installed files (RECORD) contain hashes of the old texts. They are deleted. Without them, pip
    refuses to change the files, which belong to dpkg.
    """
    for file in [environment / "pyvenv.cfg", *(environment / "bin").iterdir()]:
        if not file.is_symlink():
            text = file.read_text(encoding="utf-8")
            file.write_text(text.replace(str(environment), f"/{INSTALLED}"), encoding="utf-8")
    for record in environment.glob("lib/python*/site-packages/*.dist-info/RECORD"):
        record.unlink()


def pack(tree: Path, files: list[PackagedFile], version: str, output: Path) -> Path:
    """Write the control files of a staged tree and pack it. Return the path of the package.

    SOURCE_DATE_EPOCH must be set: the time of all files [s since 1970].
    """
    (tree / "etc/pneuforce").chmod(0o750)
    control = control_files(tree, [file.destination for file in files], version, PYTHON)
    for name, text in control.items():
        path = tree / "DEBIAN" / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(text, encoding="utf-8")
        path.chmod(0o755 if text.startswith("#!") else 0o644)
    output.mkdir(parents=True, exist_ok=True)
    _run("dpkg-deb", "-Zzstd", "--root-owner-group", "--build", tree, output)
    (package,) = output.glob(f"pneuforce_{version}_*.deb")
    return package


def build(wheel: Path, lock: Path, output: Path, revision: str) -> Path:
    """Build the package of a wheel and of locked libraries. Return its path."""
    os.umask(0o022)
    files = packaged_files(FILES.read_text(encoding="utf-8"))
    with tempfile.TemporaryDirectory(prefix="pneuforce-") as folder:
        tree = Path(folder) / "tree"
        tree.mkdir()
        stage_files(tree, files)
        stage_environment(tree, wheel, lock)
        return pack(tree, files, version_of(wheel, revision), output)


def version_of(wheel: Path, revision: str) -> str:
    """Return the Debian version of a wheel. The version 0.2.0rc1 is written 0.2.0~rc1."""
    return re.sub(r"\.?(a|b|rc|dev)(?=\d)", r"~\1", wheel.name.split("-")[1]) + f"-{revision}"


def _run(*command: str | Path) -> None:
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


def main() -> None:
    """Build the package of the command line and print its path."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("wheel", type=Path)
    parser.add_argument("--lock", type=Path, required=True, help="requirements file with hashes")
    parser.add_argument("--output", type=Path, default=ROOT / "dist")
    parser.add_argument(
        "--revision", default="1", help="Debian revision, for a rebuilt package of one version"
    )
    arguments = parser.parse_args()
    print(build(arguments.wheel, arguments.lock, arguments.output, arguments.revision))


if __name__ == "__main__":
    main()
