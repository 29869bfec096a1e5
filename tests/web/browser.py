"""Debian's Chromium as a process that is told what to do."""

from __future__ import annotations

import json
import os
import select
import subprocess
from pathlib import Path

import pytest

from tests.peers.clients.client import MODULES, NODE
from tests.tools import needs

PATIENCE_S = 30.0
NEEDS_CHROMIUM = needs("chromium")
NEEDS_PLAYWRIGHT = pytest.mark.skipif(
    not (MODULES / "playwright-core").exists() and not os.environ.get("CI"),
    reason="npm's playwright-core is missing: make test installs it (apt-get install npm)",
)


class Browser:
    """One browser with one window."""

    def __enter__(self):
        self._process = subprocess.Popen(
            # an instrument wants a priority above its neighbours', on a machine that is busy
            ["nice", "-n", "10", NODE, str(Path(__file__).with_name("browser.js"))],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=os.environ | {"NODE_PATH": str(MODULES)},
        )
        return self

    def __exit__(self, *_):
        self._process.stdin.close()
        try:
            self._process.wait(5.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._process.stdout.close()

    def __call__(self, what, **arguments):
        """What comes of it; fails the test in the browser's words."""
        self._process.stdin.write(json.dumps({"do": what, **arguments}) + "\n")
        self._process.stdin.flush()
        if not select.select([self._process.stdout], [], [], PATIENCE_S)[0]:
            pytest.fail(f"the browser has no answer to {what} {arguments}")
        answer = json.loads(self._process.stdout.readline() or '{"failed": "the browser has ended"}')
        if "failed" in answer:
            pytest.fail(f"{what} {arguments}: {answer['failed']}")
        return answer["came"]

    def text(self, of):
        """What is to be read there."""
        return self("text", of=of)

    def number(self, of):
        """The large number there."""
        return float(self.text(f"{of} .number").replace("−", "-"))

    def wait(self, script):
        """The script's value as soon as it is true."""
        return self("wait", script=script)

    def wait_for_text(self, of, text):
        """Wait until this is to be read there."""
        look = f"document.querySelector({json.dumps(of)})"
        return self.wait(f"{look}.checkVisibility() && {look}.innerText.includes({json.dumps(text)})")

    def wait_for_state(self, name):
        """Wait until the page shows this state."""
        return self.wait_for_text("#state", name)
