"""Search for known vulnerabilities of the locked libraries: `make audit`.

pip-audit sends names and versions to the service OSV. The exit code of pip-audit is the same for a
vulnerability and for a missing connection. A library that was not checked does not change the exit code. This
module therefore reads the report of pip-audit, and states "not checked" for each library without an answer.
"""

from __future__ import annotations

import datetime
import json
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).parents[1]
LOCK = ROOT / "requirements.lock"
EXCEPTIONS = ROOT / "release/audit-exceptions.toml"
PASSED, FAILED = 0, 1


class AuditResult(NamedTuple):
    """Lines to print, and the exit code."""

    lines: list[str]
    exit_code: int


def accepted(text: str, today: datetime.date) -> set[str]:
    """Return the identifiers of the valid exceptions in a TOML text.

    Raises ValueError if a key is missing, or if an exception is no longer valid.
    """
    identifiers = set()
    for entry in tomllib.loads(text).get("exception", []):
        if missing := sorted({"id", "reason", "until"} - entry.keys()):
            raise ValueError(f"an exception has no {' and no '.join(missing)}: {entry}")
        if not today <= entry["until"]:
            raise ValueError(f"the exception for {entry['id']} was valid until {entry['until']}")
        identifiers.add(entry["id"])
    return identifiers


def judge(report: dict[str, Any], exceptions: set[str]) -> AuditResult:
    """Return the result for a report of pip-audit in JSON."""
    lines, exit_code = [], PASSED
    for library in report["dependencies"]:
        name = f"{library['name']} {library.get('version', '')}".strip()
        if "skip_reason" in library:
            lines.append(f"not checked: {name}: {library['skip_reason']}")
        for found in library.get("vulns", []):
            if exceptions & {found["id"], *found["aliases"]}:
                lines.append(f"accepted by {EXCEPTIONS.name}: {name}: {found['id']}")
                continue
            fixed = ", ".join(found["fix_versions"]) or "no version"
            lines.append(f"vulnerable: {name}: {found['id']}, corrected in: {fixed}")
            exit_code = FAILED
    checked = sum("skip_reason" not in library for library in report["dependencies"])
    return AuditResult([*lines, f"{checked} of {len(report['dependencies'])} libraries checked"], exit_code)


def audit(lock: Path, exceptions: set[str], options: list[str]) -> AuditResult:
    """Run pip-audit on a lock file with additional options, and return the result."""
    tool = Path(sys.executable).with_name("pip-audit")
    service = ("--vulnerability-service", "osv", "--timeout", "5", "--progress-spinner", "off")
    source = ("--disable-pip", "--require-hashes", "--requirement", lock)
    done = subprocess.run(
        [tool, *service, *source, "--format", "json", *options], capture_output=True, text=True, check=False
    )
    if done.stdout.startswith("{"):
        return judge(json.loads(done.stdout), exceptions)
    reason = done.stderr.strip().rpartition("\n")[2] or f"exit code {done.returncode}"
    if "ConnectionError" in done.stderr or "ConnectTimeout" in done.stderr:
        return AuditResult([f"not checked: no connection to the vulnerability service: {reason}"], PASSED)
    return AuditResult([f"not checked: pip-audit failed: {reason}"], FAILED)


def main(options: list[str]) -> int:
    """Print the result for requirements.lock and return the exit code. The options are those of pip-audit."""
    try:
        exceptions = accepted(EXCEPTIONS.read_text(encoding="utf-8"), datetime.date.today())
    except ValueError as error:
        print(f"{EXCEPTIONS.name}: {error}. Correct the file", file=sys.stderr)
        return FAILED
    result = audit(LOCK, exceptions, options)
    print("make audit:", "\nmake audit: ".join(result.lines))
    return result.exit_code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
