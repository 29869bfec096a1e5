"""Chromium of Debian, controlled through a child process (browser.js)."""

from __future__ import annotations

import contextlib
import json
import os
import select
import subprocess
from pathlib import Path

import pytest

from tests.peers.clients.client import MODULES, NODE
from tests.tools import needs

TIMEOUT_S = 90.0  #: longer than the timeout of browser.js, whose message contains the text of the page
NEEDS_CHROMIUM = needs("chromium")
NEEDS_PLAYWRIGHT = pytest.mark.skipif(
    not (MODULES / "playwright-core").exists() and not os.environ.get("CI"),
    reason="npm's playwright-core is missing: make test installs it (apt-get install npm)",
)


class Browser:
    """One browser with one page. The arguments are environment variables of the browser."""

    def __init__(self, **environment):
        self._environment = environment

    def __enter__(self):
        self._process = subprocess.Popen(
            # lower priority than the instrument, which must keep its timing on a busy machine
            ["nice", "-n", "10", NODE, str(Path(__file__).with_name("browser.js"))],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=os.environ | {"NODE_PATH": str(MODULES)} | self._environment,
        )
        return self

    def __exit__(self, *_):
        with contextlib.suppress(BrokenPipeError):  # the process has ended
            self._process.stdin.close()
        try:
            self._process.wait(60)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._process.stdout.close()

    def __call__(self, action, **arguments):
        """Run an action of browser.js and return its result; fail the test if the action fails."""
        try:
            self._process.stdin.write(json.dumps({"do": action, **arguments}) + "\n")
            self._process.stdin.flush()
        except BrokenPipeError:
            pytest.fail("the browser has exited")
        if not select.select([self._process.stdout], [], [], TIMEOUT_S)[0]:
            pytest.fail(f"the browser did not answer to {action} {arguments} within {TIMEOUT_S:g} s")
        answer = json.loads(self._process.stdout.readline() or '{"error": "the browser has exited"}')
        if "error" in answer:
            pytest.fail(f"{action} {arguments}: {answer['error']}")
        return answer["result"]

    def evaluate(self, script):
        """Return the value of a script."""
        return self("evaluate", script=script)

    def text(self, of):
        """Return the visible text of an element."""
        return self("text", of=of)

    def number(self, of):
        """Return the number that a reading shows in large digits."""
        return float(self.text(f"{of} .number").replace("−", "-"))

    def data(self, of, name):
        """Return a data attribute of an element."""
        return self.evaluate(f"document.querySelector({json.dumps(of)}).dataset[{json.dumps(name)}]")

    def is_hidden(self, of):
        """Return True if an element has the attribute `hidden`."""
        return self.evaluate(f"document.querySelector({json.dumps(of)}).hidden")

    def wait(self, script):
        """Wait until the value of a script is true, and return the value."""
        return self("wait", script=script)

    def wait_for_text(self, of, text):
        """Wait until an element is visible and contains this text."""
        element = f"document.querySelector({json.dumps(of)})"
        return self.wait(f"{element}?.checkVisibility() && {element}.innerText.includes({json.dumps(text)})")

    def wait_for_visible(self, of):
        """Wait until an element exists and is visible."""
        return self.wait(f"document.querySelector({json.dumps(of)})?.checkVisibility()")

    def wait_for_hidden(self, of):
        """Wait until an element has the attribute `hidden`."""
        return self.wait(f"document.querySelector({json.dumps(of)}).hidden")

    def wait_for_state(self, name):
        """Wait until the page shows this state of the rig."""
        return self.wait_for_visible(f"#state[data-state={name}]")
