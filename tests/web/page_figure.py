"""Command that takes a picture of the web page: python -m tests.web.page_figure FILE [WIDTH HEIGHT [SCHEME]].

The command starts an instrument on the simulated rig. The simulated hand presses the balloon again and again.
Chromium takes the picture during a contact. SCHEME is light or dark.
"""

import sys
import time
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image

from pneuforce.teststand.rig import LiveRig
from pneuforce.teststand.stack import free_port, start
from tests.web.browser import Browser
from tests.web.users import OPERATOR, PASSWORD, users_file

HOLD_S = 42.0  #: the plots show the last 30 s; the inflation and the first press must not be shown


def make(file, width=1280, height=1100, scheme="light"):
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
                "users_file": users_file(folder),
                "recordings": str(folder / "recordings"),
            },
        }
        browser = children.enter_context(Browser())
        rig = LiveRig(start(children, folder / "rig", ["--seed", "1"], tables))
        browser("open", url=f"http://127.0.0.1:{port}/#user={OPERATOR}&password={PASSWORD}")
        browser("resize", width=width, height=height, scheme=scheme)
        browser.wait_for_state("vented")
        rig.inflate(8.0)
        time.sleep(HOLD_S)
        browser.wait_for_text("#state", "in contact")
        browser("screenshot", path=str(file))
    Image.open(file).quantize().save(file, optimize=True)  # 256 colours: a third of the size


if __name__ == "__main__":
    path, *size = sys.argv[1:]
    make(path, *map(int, size[:2]), *size[2:])
