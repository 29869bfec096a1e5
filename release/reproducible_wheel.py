"""Rewriting of a wheel so that its bytes depend only on the content of its files.

`make wheel` runs this module, because setuptools copies the modes of the files from the clone.
"""

from __future__ import annotations

import os
import sys
import time
import zipfile
from pathlib import Path

#: A zip file cannot contain an earlier time [s since 1970].
EARLIEST_S = 315_532_800
READABLE_FILE = 0o100644 << 16


def rewrite(wheel: Path, time_s: int) -> None:
    """Give all files of a wheel the same time and mode, and sort them. The time is in seconds since 1970.

    The files of the folder .dist-info stay at the end, as the specification of wheels recommends.
    """
    date = time.gmtime(max(time_s, EARLIEST_S))[:6]
    with zipfile.ZipFile(wheel) as archive:
        content = {name: archive.read(name) for name in archive.namelist() if not name.endswith("/")}
    new = wheel.with_suffix(".new")
    with zipfile.ZipFile(new, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in sorted(content, key=lambda name: (".dist-info/" in name, name)):
            entry = zipfile.ZipInfo(name, date)
            entry.external_attr = READABLE_FILE
            archive.writestr(entry, content[name], zipfile.ZIP_DEFLATED, compresslevel=9)
    new.replace(wheel)


if __name__ == "__main__":
    rewrite(Path(sys.argv[1]), int(os.environ["SOURCE_DATE_EPOCH"]))
