"""Starvation: the time for which a test and its child processes waited for a processor or for the disk.

A thread waits in a run queue of the kernel, or because a hypervisor runs other machines on its processor.
The waits of all processes of a test are added: a value passes through a simulator, an instrument, a web
process and a browser one after another, so that many short waits make it as late as one long wait.

Tests in real time fail if the computer does not run their processes in time. Such a failure says nothing
about the product, so the test is repeated, at most twice, and the summary names it. A test that fails for
another reason is not repeated.
"""

import contextlib
import os
import time
from collections.abc import Iterator
from pathlib import Path
from threading import Event, Thread

import psutil

HEARTBEAT_S = 0.05
MAX_LATE_S = 0.1  #: a test is starved if the thread that measures is late by more than this
WINDOW_S = 0.5  #: time between two readings of the waits
#: A test is starved if the sum of its waits in one window is longer than this. Without other work, a
#: test waits for 0.03 s (median), and 18 of 180 tests, mostly in a browser, wait for more than this.
MAX_WAIT_S = 0.3
#: Waits of all processes for the disk and for memory (Linux, Documentation/accounting/psi.rst).
STALLS = [Path("/proc/pressure/io"), Path("/proc/pressure/memory")]


class StarvationMonitor:
    """Thread that measures the waits of this process and its descendants since `restart`."""

    def __init__(self) -> None:
        self.longest_s = 0.0
        self.starved = False
        self._waited_s: dict[tuple[int | str, int], float] = {}
        self._family = {os.getpid()}
        self._running: set[int] = set()
        self._stop = Event()
        self._thread = Thread(target=self._run, daemon=True)

    def start(self) -> None:
        """Start measuring."""
        self._thread.start()

    def stop(self) -> None:
        """Stop measuring."""
        self._stop.set()
        if self._thread.is_alive():
            self._thread.join()

    def restart(self) -> None:
        """Discard all measurements, because another test begins."""
        self.longest_s = 0.0
        self.starved = False

    def _run(self) -> None:
        window_end_s = 0.0
        while True:
            before_s = time.monotonic()
            if self._stop.wait(HEARTBEAT_S):
                return
            now_s = time.monotonic()
            self.add(now_s - before_s - HEARTBEAT_S, MAX_LATE_S)
            if now_s >= window_end_s:
                self.read_waits()
                window_end_s = time.monotonic() + WINDOW_S

    def add(self, wait_s: float, limit_s: float) -> None:
        """Add one wait [s]. A wait above `limit_s` can explain a failure."""
        self.longest_s = max(self.longest_s, wait_s)
        self.starved = self.starved or wait_s > limit_s

    def read_waits(self) -> None:
        """Add the waits since the last reading: the longest wait of each process, added for all processes.

        A thread that has started since the last reading is not measured until the next reading.
        """
        waited_s = {(who, part): total_s for who, part, total_s in self._waits()}
        longest_s: dict[int | str, float] = {}
        for (who, part), total_s in waited_s.items():
            wait_s = total_s - self._waited_s.get((who, part), total_s)
            longest_s[who] = max(wait_s, longest_s.get(who, 0.0))
        self.add(sum(longest_s.values()), MAX_WAIT_S)
        self._waited_s = waited_s

    def _waits(self) -> Iterator[tuple[int | str, int, float]]:
        """Yield process, thread and total waiting time [s] for this process and its descendants.

        The source is the second field of schedstat (Linux, Documentation/scheduler/sched-stats.rst). Systems
        without schedstat show only the delay of this thread.

        A hypervisor is like one more process: while it runs other machines, a processor waits ("steal" of
        proc(5)), which is in no schedstat. The disk and the memory are like processes, too: their waiting
        time is the time in which at least one process of this computer waited for them.
        """
        for file in STALLS:
            with contextlib.suppress(OSError):  # not every kernel has these files
                yield file.name, 0, int(file.read_text().split()[4].removeprefix("total=")) * 1e-6
        for number, times in enumerate(psutil.cpu_times(percpu=True)):
            yield "hypervisor", number, getattr(times, "steal", 0.0)
        self._find_new_descendants()
        for pid in self._family:
            with contextlib.suppress(OSError):
                for thread in os.listdir(f"/proc/{pid}/task"):
                    schedstat = Path(f"/proc/{pid}/task/{thread}/schedstat").read_text()
                    yield pid, int(thread), int(schedstat.split()[1]) * 1e-9

    def _find_new_descendants(self) -> None:
        """Add new processes whose parent is known. Other processes are looked at only once."""
        running = set(psutil.pids())
        self._family &= running
        for pid in sorted(running - self._running):
            with contextlib.suppress(psutil.Error):
                if psutil.Process(pid).ppid() in self._family:
                    self._family.add(pid)
        self._running = running
