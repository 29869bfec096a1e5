"""Child processes that end together with their parent process."""

from __future__ import annotations

import contextlib
import ctypes
import json
import os
import selectors
import signal
import subprocess
import sys
import time
from collections import deque
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from threading import Event, Thread
from typing import IO, Any, Self

from pneuforce.errors import PneuforceError

_PR_SET_PDEATHSIG = 1
STOP_TIMEOUT_S = 0.6
VENT_WAIT_S = 0.1  #: time that an instrument gets to verify that its simulated rig is vented
#: Longest time without a line on stderr until a process is ready. The first start on a slow computer computes
#: tables for minutes, and prints its progress.
START_TIMEOUT_S = 60.0
#: Longest time from the end of the output of a process to its end. A busy computer needs more than 1 s.
EXIT_TIMEOUT_S = 10.0


class ChildProcessFailed(PneuforceError):
    """Error for a child process that has ended or was not ready in time."""


class StartCancelled(Exception):
    """Request to stop, received during the start of a child process."""


class ChildProcess:
    """Python module that runs as a process. Its last lines on stderr are kept for error messages.

    Python looks for the module among the installed modules, not in the working directory.
    """

    _process: subprocess.Popen[str]
    _reader: Thread

    def __init__(self, name: str, arguments: Sequence[str]) -> None:
        """Start `python -m` with these arguments. `name` describes the process in error messages."""
        self.name = name
        self.stderr_lines: deque[str] = deque(maxlen=200)
        self.killed = False  #: by `kill`, until the next start
        self.reported = False  #: an error about the end of the process was created
        self.stopped = False  #: by the end of the `with` statement
        self._command = [sys.executable, "-P", "-m", *arguments]
        self._input = ""
        self._start()

    def _start(self) -> None:
        self._last_line_s = time.monotonic()
        self._process = _starter(os.getpid()).submit(_started, self._command).result()
        assert self._process.stderr is not None
        self._reader = Thread(target=self._read, args=(self._process.stderr,), daemon=True)
        self._reader.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()
        self.stopped = True

    def restart(self) -> None:
        """Start the ended process again, with the same arguments and the same input."""
        self.stop()
        self.killed = self.reported = False
        self._start()
        self.write_stdin(self._input)

    def kill(self) -> None:
        """Kill the process. This end is not an error."""
        self.killed = True
        self._process.kill()
        self._process.wait()

    def _read(self, stream: IO[str]) -> None:
        for line in stream:
            self.stderr_lines.append(line.rstrip())
            self._last_line_s = time.monotonic()

    @property
    def pid(self) -> int:
        """Return the process id."""
        return self._process.pid

    @property
    def running(self) -> bool:
        """Return True until the process has ended."""
        return self._process.poll() is None

    def ready(self, stop: Event | None = None) -> dict[str, Any]:
        """Wait until the process is ready. Return the JSON line that it then prints.

        Raises ChildProcessFailed if the process ends, or if it prints nothing for `START_TIMEOUT_S`;
        StartCancelled if `stop` is set.
        """
        assert self._process.stdout is not None
        begin_s = time.monotonic()
        with selectors.DefaultSelector() as selector:
            selector.register(self._process.stdout, selectors.EVENT_READ)
            while not selector.select(0.05):
                if stop is not None and stop.is_set():
                    raise StartCancelled
                if time.monotonic() > max(begin_s, self._last_line_s) + START_TIMEOUT_S:
                    raise self._not_ready()
        line = self._process.stdout.readline()
        if not line:
            raise self.failure()
        answer: dict[str, Any] = json.loads(line)
        return answer

    def _not_ready(self) -> ChildProcessFailed:
        """Return an exception for a process that runs, but is not ready."""
        last = f" after the line {self.stderr_lines[-1]!r}" if self.stderr_lines else ""
        return ChildProcessFailed(
            f"the {self.name} is not ready: it has printed nothing for {START_TIMEOUT_S:g} s{last}; the "
            "computer is too busy or too slow: end other programs, and try again"
        )

    def write_stdin(self, text: str) -> None:
        """Write the complete input of the process, and close its stdin."""
        self._input = text
        assert self._process.stdin is not None
        with contextlib.suppress(BrokenPipeError):  # the process has ended; `ready` raises an error
            self._process.stdin.write(text)
            self._process.stdin.close()

    def send(self, number: signal.Signals) -> None:
        """Send a signal to the process."""
        self._process.send_signal(number)

    def stop_and_read(self) -> Any:
        """End the process. Return the JSON line that the process prints last."""
        self._process.send_signal(signal.SIGTERM)
        assert self._process.stdout is not None
        return json.loads(self._process.stdout.readlines()[-1])

    def failure(self) -> ChildProcessFailed:
        """Return an exception with the exit code or the signal, and with the last line on stderr."""
        if self.stopped:
            return ChildProcessFailed(
                f"the {self.name} was ended: use the rig only within its `with` statement, or within the test"
            )
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(EXIT_TIMEOUT_S)
        self._reader.join(1.0)
        self.reported = True
        printed = self.stderr_lines[-1].removeprefix("pneuforce: ") if self.stderr_lines else "no message"
        return ChildProcessFailed(f"the {self.name} {self._end()}; it last printed: {printed}")

    def _end(self) -> str:
        """Return how the process has ended. A process can close its output some time before its end."""
        code = self._process.returncode
        if code is None:
            return "has closed its output, but has not ended"
        return f"ended with {f'the signal {signal.Signals(-code).name}' if code < 0 else f'exit code {code}'}"

    def stop(self) -> None:
        """End the process by SIGTERM. Kill the process if it does not end within 0.7 s.

        A second SIGTERM ends the wait of an instrument for the verification of the vent.
        """
        for longest_s in (VENT_WAIT_S, STOP_TIMEOUT_S):
            if self.running:
                self._process.send_signal(signal.SIGTERM)
                with contextlib.suppress(subprocess.TimeoutExpired):
                    self._process.wait(longest_s)
        if self.running:
            self._process.kill()
            self._process.wait()
        self._reader.join(0.1)
        for stream in (self._process.stdin, self._process.stdout, self._process.stderr):
            if stream is not None:
                with contextlib.suppress(BrokenPipeError):
                    stream.close()


def _started(command: list[str]) -> subprocess.Popen[str]:
    return subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # Only the parent receives Ctrl-C. It then ends its children in the correct order.
        start_new_session=True,
        preexec_fn=_end_with_parent,
    )


@cache
def _starter(pid: int) -> ThreadPoolExecutor:  # noqa: ARG001
    """Return the thread that starts all child processes of the process `pid`.

    Linux ends a child process together with the thread that started it, so this thread must not end.
    """
    return ThreadPoolExecutor(1, "start of child processes")


def _end_with_parent() -> None:
    """Make Linux send SIGTERM to this process when the parent process ends for any reason."""
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
