"""Line coverage of the firmware's headers, from gcov: `python -m tests.firmware.coverage FOLDER`.

The tests write the data into FOLDER if the environment variable PNEUFORCE_GCOV names it; see `make coverage`.
The sketch itself and hardware.h run only on the chip and are not counted.
"""

import re
import subprocess
import sys
from pathlib import Path

from tests.firmware.compiled import ROOT

FIRMWARE = (ROOT / "firmware/pneuforce").resolve()
FILE = re.compile(r"File '([^']+)'\nLines executed:([\d.]+)% of (\d+)")


def lines_by_header(folder):
    """Return executed and total lines of each header of the firmware."""
    report = subprocess.run(
        ["gcov", "--no-output", *map(str, folder.glob("*.gcda"))],
        cwd=folder,
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    found = {}
    for name, percent, total in FILE.findall(report):
        path = Path(name).resolve()
        if path.is_relative_to(FIRMWARE):
            found[path.name] = round(float(percent) * int(total) / 100), int(total)
    return found


def main():
    """Print the coverage of each header and of all headers together."""
    found = lines_by_header(Path(sys.argv[1]).resolve())
    for name, (executed, total) in sorted(found.items()):
        print(f"firmware {name}: {executed} of {total} lines")
    executed, total = (sum(column) for column in zip(*found.values(), strict=True))
    print(f"Firmware: {executed / total:.0%} of lines")


if __name__ == "__main__":
    main()
