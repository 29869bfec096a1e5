"""Child processes that end with their parent, whatever ends it."""

from __future__ import annotations

import contextlib
import ctypes
import json
import selectors
import signal
import subprocess
import sys
import time
from collections import deque
from collections.abc import Sequence
from threading import Event, Thread
from typing import IO, Any, Self

from instrument.errors import PneuforceError

_PR_SET_PDEATHSIG = 1
STOP_S = 0.6
START_S = 20.0


class ChildFailed(PneuforceError):
    """A child process ended, or did not get ready."""


class Stopped(Exception):
    """Whoever waited for a child was asked to end."""


class Child:
    """A Python module run as a process; its stderr is kept for whoever asks why it ended.

    It is found among what is installed: a folder that is called alike where a user works is not it.
    """

    def __init__(self, name: str, arguments: Sequence[str]) -> None:
        self.name = name
        self.said: deque[str] = deque(maxlen=200)
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,  # Ctrl-C reaches the parent alone, which ends its children in order
            preexec_fn=_end_with_parent,
        )
        assert self._process.stderr is not None
        self._reader = Thread(target=self._read, args=(self._process.stderr,), daemon=True)
        self._reader.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def _read(self, stream: IO[str]) -> None:
        for line in stream:
            self.said.append(line.rstrip())

    @property
    def pid(self) -> int:
        """Its process id."""
        return self._process.pid

    @property
    def running(self) -> bool:
        """Whether it has not ended."""
        return self._process.poll() is None

    def ready(self, stop: Event | None = None) -> dict[str, Any]:
        """The JSON line with which it says that it is ready.

        Raises ChildFailed, or Stopped where `stop` is set first.
        """
        assert self._process.stdout is not None
        until_s = time.monotonic() + START_S
        with selectors.DefaultSelector() as selector:
            selector.register(self._process.stdout, selectors.EVENT_READ)
            while not selector.select(0.05) and time.monotonic() < until_s:
                if stop is not None and stop.is_set():
                    raise Stopped
        line = self._process.stdout.readline() if time.monotonic() < until_s else ""
        if not line:
            raise self.failure()
        answer: dict[str, Any] = json.loads(line)
        return answer

    def tell(self, text: str) -> None:
        """All that it will ever read from its stdin."""
        assert self._process.stdin is not None
        with contextlib.suppress(BrokenPipeError):  # it has ended: `ready` says why
            self._process.stdin.write(text)
            self._process.stdin.close()

    def send(self, number: signal.Signals) -> None:
        """Send it a signal."""
        self._process.send_signal(number)

    def last_words(self) -> Any:
        """End it and return the JSON line that it prints last."""
        self._process.send_signal(signal.SIGTERM)
        assert self._process.stdout is not None
        return json.loads(self._process.stdout.readlines()[-1])

    def failure(self) -> ChildFailed:
        """Why it ended, in its own last words."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(1.0)
        self._reader.join(1.0)
        words = self.said[-1].removeprefix("pneuforce: ") if self.said else "it said nothing"
        return ChildFailed(f"the {self.name} ended: {words}")

    def stop(self) -> None:
        """End it: asked first, killed where it does not within 0.6 s."""
        if self.running:
            self._process.send_signal(signal.SIGTERM)
        try:
            self._process.wait(STOP_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._reader.join(0.1)
        for stream in (self._process.stdin, self._process.stdout, self._process.stderr):
            if stream is not None:
                with contextlib.suppress(BrokenPipeError):
                    stream.close()


def _end_with_parent() -> None:
    """Let Linux send SIGTERM when the parent dies, however that comes."""
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
