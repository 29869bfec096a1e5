"""Command that takes a picture of the web page: python -m tests.web.page_figure FILE [WIDTH HEIGHT [SCHEME]].

The command starts an instrument on the simulated rig, presses the balloon several times, and takes the
picture in Chromium. SCHEME is light or dark.
"""

import sys
import time
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory

from pneuforce.teststand.rig import LiveRig
from pneuforce.teststand.stack import free_port, start
from tests.web.browser import Browser

FORCES_N = (1.0, 2.5, 1.6, 3.2)
PRESSED_S = 1.0
BETWEEN_S = 2.0
TOKEN = "only-for-the-figure"


def make(file, width=1440, height=900, scheme="light"):
    """Take a picture of the page with several contacts. The last contact is in progress."""
    with TemporaryDirectory() as name, ExitStack() as children:
        folder = Path(name)
        port = free_port()
        tables = {
            "rig": {"port": str(folder / "rig")},
            "modbus": {"port": free_port()},
            "can": {"enabled": False},
            "events": {"file": str(folder / "events.sqlite")},
            "local": {"socket": str(folder / "pneuforce.sock")},
            "identity": {"serial_number": 7},
            "web": {
                "enabled": True,
                "port": port,
                "token": TOKEN,
                "recordings": str(folder / "recordings"),
            },
        }
        browser = children.enter_context(Browser())
        rig = LiveRig(start(children, folder / "rig", ["--no-hand", "--seed", "1"], tables))
        browser("open", url=f"http://127.0.0.1:{port}/#operator={TOKEN}")
        browser("resize", width=width, height=height, scheme=scheme)
        rig.inflate(8.0)
        _press(rig, browser)
        browser("screenshot", path=str(file))


def _press(rig, browser):
    for force_n in FORCES_N:
        rig.press(force_n)
        time.sleep(PRESSED_S)
        if force_n != FORCES_N[-1]:
            rig.release()
            time.sleep(BETWEEN_S)
    browser.wait_for_text("#state", "in contact")


if __name__ == "__main__":
    path, *size = sys.argv[1:]
    make(path, *map(int, size[:2]), *size[2:])
