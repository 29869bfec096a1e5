"""Control files of the Debian package: fields, checksums, conffiles and maintainer scripts."""

from __future__ import annotations

import hashlib
import subprocess
from pathlib import Path

FOLDER = Path(__file__).parent / "debian"
SCRIPTS = ("preinst", "postinst", "prerm", "postrm")
UNITS = "usr/lib/systemd/system/"
#: Shared libraries that the wheels of numpy and scipy do not contain, and systemd-sysusers.
DEPENDS = ("libc6 (>= 2.28)", "libgcc-s1", "libstdc++6", "systemd", "zlib1g")


def control_files(tree: Path, destinations: list[str], version: str, python: str) -> dict[str, str]:
    """Return name and text of each control file for a staged tree. The paths have no first slash."""
    scripts = {name: (FOLDER / name).read_text(encoding="utf-8") for name in SCRIPTS}
    units = [path.removeprefix(UNITS) for path in destinations if path.startswith(UNITS)]
    # "@." is in the name of a template unit, and "@*." matches its instances.
    patterns = [unit.replace("@.", "@*.") for unit in units]
    values = {
        "VERSION": version,
        "ARCHITECTURE": _output_of("dpkg", "--print-architecture"),
        "SIZE": str(_size_kib(tree)),
        "DEPENDS": ", ".join(sorted([*DEPENDS, *_python_dependencies(python)])),
        "UNIT_PATTERNS": " ".join(f"'{pattern}'" for pattern in patterns),
        "UNIT_LINKS": " ".join(f"*.wants/{pattern}" for pattern in patterns),
    }
    texts = {"control": (FOLDER / "control").read_text(encoding="utf-8"), **scripts}
    for name, value in values.items():
        texts = {file: text.replace(f"@{name}@", value) for file, text in texts.items()}
    conffiles = [path for path in destinations if path.startswith("etc/")]
    texts["conffiles"] = "".join(f"/{path}\n" for path in conffiles)
    texts["md5sums"] = _md5sums(tree, set(conffiles))
    return texts


def _python_dependencies(python: str) -> tuple[str, str]:
    """Return the allowed versions of Debian's Python: only the minor version for which numpy is compiled."""
    minor = int(_output_of(python, "-c", "import sys; print(sys.version_info.minor)"))
    return f"python3 (>= 3.{minor}~)", f"python3 (<< 3.{minor + 1}~)"


def _files_of(tree: Path) -> list[Path]:
    return sorted(path for path in tree.rglob("*") if path.is_file() and not path.is_symlink())


def _size_kib(tree: Path) -> int:
    """Return the size of the installed files in KiB. Each file is rounded up, as in the policy of Debian."""
    return sum(-(-path.stat().st_size // 1024) for path in _files_of(tree))


def _md5sums(tree: Path, without: set[str]) -> str:
    """Return the checksums for `dpkg --verify`. dpkg keeps its own checksums of conffiles."""
    names = [path.relative_to(tree).as_posix() for path in _files_of(tree)]
    return "".join(
        f"{hashlib.md5((tree / name).read_bytes()).hexdigest()}  {name}\n"
        for name in names
        if name not in without
    )


def _output_of(*command: str) -> str:
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()
