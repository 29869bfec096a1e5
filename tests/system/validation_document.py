"""Command that renews the results in docs/validation.md: python -m tests.system.validation_document.

The command repeats both campaigns, which takes some minutes, and replaces the tables. It does not change the
sentences. `test_validation_document.py` compares their figures with the tables.
"""

import json
import re
from pathlib import Path

from tests.command_runner import pneuforce

ROOT = Path(__file__).parents[2]
FILE = ROOT / "docs/validation.md"
SHORT_SCENARIO = ROOT / "docs/examples/three-pressures.toml"
#: Balloons of the campaign, with the additional options of the command.
PLANTS = {"published": (), "membrane": ("--figures", ROOT / "docs/figures", "--overwrite")}


def run(*words):
    """Return the output of `pneuforce validate`."""
    done = pneuforce("validate", *words, timeout_s=600)
    assert done.returncode == 0, done.stderr
    return done.stdout


def block_of(document, plant):
    """Return the results of the campaign on a balloon in the document."""
    return re.search(rf"^### The {plant} plant.*?```text\n(.*?)```", document, re.DOTALL | re.MULTILINE)[1]


def campaign(plant):
    """Run the campaign and return its tables, without the lines about its source and the note."""
    report = run("--plant", plant, *PLANTS[plant])
    lines = [line.rstrip() for line in report[report.index("peak force:") :].splitlines()]
    last = next(number for number, line in enumerate(lines) if " s evaluated, " in line)
    return "\n".join(lines[: last + 1]) + "\n"


def short_campaign_row(plant):
    """Run the short campaign and return its row in the document."""
    report = json.loads(run("--scenario", SHORT_SCENARIO, "--plant", plant, "--json"))
    contacts, continuous = report["contacts"], report["continuous"]
    error = report["peak_errors_percent"][0]["energetic"]["absolute"]
    return (
        f"| `{plant}` | {contacts['found']} | {contacts['evaluated']} | {error:.2f} % "
        f"| {continuous['compensated_n']:.3f} N | {continuous['uncompensated_n']:.3f} N |"
    )


def main():
    """Renew the document."""
    document = FILE.read_text(encoding="utf-8")
    for plant in PLANTS:
        document = document.replace(block_of(document, plant), campaign(plant))
        row = re.compile(rf"^\| `{plant}` \| \d.*$", re.MULTILINE)
        document = row.sub(short_campaign_row(plant), document)
    FILE.write_text(document, encoding="utf-8")


if __name__ == "__main__":
    main()
