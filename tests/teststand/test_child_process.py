"""Tests of the start of child processes: progress extends the wait, and the message states the cause."""

from threading import Thread

import pytest

from pneuforce.teststand import child_process
from pneuforce.teststand.child_process import ChildProcess, ChildProcessFailed

#: The time without a line is longer than a stall of a busy computer, and shorter than the slow start.
TIMEOUT_S = 3.0
SLOW_START = """
import sys, time
for percent in range(5):
    print(f"computing: {percent} %", file=sys.stderr, flush=True)
    time.sleep(1.0)
print("{}", flush=True)
time.sleep(60)
"""
SILENT_START = "import sys, time; print('computing: 3 %', file=sys.stderr, flush=True); time.sleep(60)"
UNENDED = "import os, sys, time; print('pneuforce: ending', file=sys.stderr); os.close(1); time.sleep(60)"
SLOW_END = """
import os, sys, time
print("pneuforce: no such file", file=sys.stderr, flush=True)
os.close(1)
time.sleep(2.0)
sys.exit(3)
"""
FAILED_START = "import sys; sys.exit('pneuforce: no such file')"


@pytest.fixture
def start(monkeypatch, tmp_path):
    """Return a function that starts a program, and waits until the process is ready."""
    monkeypatch.setattr(child_process, "START_TIMEOUT_S", TIMEOUT_S)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))

    def start_program(program):
        (tmp_path / "started_program.py").write_text(program)
        with ChildProcess("simulator", ["started_program"]) as child:
            return child.ready()

    return start_program


def test_a_process_that_prints_its_progress_may_start_slowly(start):
    assert start(SLOW_START) == {}


def test_a_process_that_prints_nothing_is_not_ready(start):
    with pytest.raises(ChildProcessFailed, match=r"not ready.*3 s after the line 'computing: 3 %'.*too slow"):
        start(SILENT_START)


def test_a_process_that_ends_is_reported_with_its_reason(start):
    with pytest.raises(ChildProcessFailed, match=r"simulator ended with exit code 1; .*: no such file"):
        start(FAILED_START)


def test_the_exit_code_of_a_process_that_ends_slowly_is_reported(start):
    with pytest.raises(ChildProcessFailed, match=r"simulator ended with exit code 3; .*: no such file"):
        start(SLOW_END)


def test_no_exit_code_is_stated_for_a_process_that_has_not_ended(start, monkeypatch):
    monkeypatch.setattr(child_process, "EXIT_TIMEOUT_S", 0.1)
    with pytest.raises(
        ChildProcessFailed, match=r"simulator has closed its output, but has not ended; .*: ending"
    ):
        start(UNENDED)


def test_a_process_that_a_thread_has_started_runs_after_the_end_of_the_thread(monkeypatch, tmp_path):
    """Linux can end a child process together with the thread that has started it."""
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    (tmp_path / "started_program.py").write_text(
        "import time; print('{}', flush=True); input(); print('{}', flush=True); time.sleep(60)"
    )
    started = []
    thread = Thread(target=lambda: started.append(ChildProcess("simulator", ["started_program"])))
    thread.start()
    thread.join()
    with started[0] as child:
        child.ready()
        child.write_stdin("go on\n")
        assert child.ready() == {}
