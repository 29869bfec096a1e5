"""Tests of the measurement of starvation, and of the repetition of starved tests."""

import ast
import os
import subprocess
import sys
import threading
import time
from types import SimpleNamespace

import psutil
import pytest

from tests import conftest, starvation
from tests.source_tree import ROOT, TESTS, name_of
from tests.starvation import StarvationMonitor
from tests.system.waiting import wait_for

pytest_plugins = ["pytester"]

#: Program that occupies a processor. All processes of this program run on the same processor.
CROWD = "import os\nos.sched_setaffinity(0, {min(os.sched_getaffinity(0))})\nwhile True: pass"


def test_a_child_process_that_waits_for_a_processor_is_starved():
    monitor = StarvationMonitor()
    crowd = [subprocess.Popen([sys.executable, "-c", CROWD]) for _ in range(4)]
    try:
        monitor.start()
        until_s = time.monotonic() + 20.0
        while not monitor.starved and time.monotonic() < until_s:
            time.sleep(0.05)
        monitor.stop()
    finally:
        for process in crowd:
            process.kill()
            process.wait()
    assert monitor.starved


def test_a_process_that_sleeps_is_not_starved():
    with subprocess.Popen(["sleep", "10"]) as sleeper:
        monitor = StarvationMonitor()
        waits = {process: wait_s for process, _, wait_s in monitor._waits()}
        sleeper.kill()
    assert set(waits) >= {os.getpid(), sleeper.pid}
    assert waits[sleeper.pid] < 0.5


def test_each_thread_is_measured():
    """The low priority of one thread, for example of the check of a password, can starve a test."""
    ended, ids = threading.Event(), []
    thread = threading.Thread(target=lambda: (ids.append(threading.get_native_id()), ended.wait()))
    thread.start()
    wait_for(lambda: ids, bool)
    waits = {(process, part) for process, part, _ in StarvationMonitor()._waits()}
    ended.set()
    thread.join()
    assert waits >= {(os.getpid(), part) for part in (os.getpid(), *ids)}


@pytest.fixture
def alone(monkeypatch, tmp_path):
    """Monitor that measures no thread, and the files that it reads: the time that was stolen, and a stall."""
    stall, stolen_s = tmp_path / "io", [0.0]
    stall.write_text(STALL.format(0))
    monkeypatch.setattr(starvation, "STALLS", [stall, tmp_path / "absent"])
    monkeypatch.setattr(
        psutil, "cpu_times", lambda percpu: [SimpleNamespace(steal=stolen_s[0]), SimpleNamespace(user=1.0)]
    )
    monitor = StarvationMonitor()
    monitor._find_new_descendants = monitor._family.clear
    monitor.read_waits()
    return monitor, stolen_s, stall


STALL = "some avg10=0.00 avg60=0.00 avg300=0.00 total={}\nfull avg10=0.00 avg60=0.00 avg300=0.00 total=0\n"


@pytest.mark.parametrize(
    ("stolen", "stalled_us", "starved"), [(0.4, 0, True), (0.0, 400000, True), (0.2, 90000, False)]
)
def test_stolen_processor_time_and_a_slow_disk_are_measured(alone, stolen, stalled_us, starved):
    monitor, stolen_s, stall = alone
    stolen_s[0] = stolen
    stall.write_text(STALL.format(stalled_us))
    monitor.read_waits()
    assert monitor.starved == starved
    assert monitor.longest_s == pytest.approx(stolen + stalled_us * 1e-6)


@pytest.mark.parametrize(("processes", "threads", "starved"), [(10, 1, True), (1, 10, False), (2, 10, False)])
def test_the_longest_waits_of_all_processes_are_added(monkeypatch, alone, processes, threads, starved):
    monitor, *_ = alone
    for wait_s in (0.0, 0.04):
        waits = [(process, thread, wait_s) for process in range(processes) for thread in range(threads)]
        monkeypatch.setattr(monitor, "_waits", lambda waits=waits: iter(waits))
        monitor.read_waits()
    assert monitor.starved == starved


CONFTEST = """
from pathlib import Path
from tests.conftest import *
real_time_paths.append(Path.cwd())
monitor.start = lambda: None  # only the test itself says that it is starved
"""
STARVED_OR_NOT = """
import pytest
from tests import conftest

runs = []

@pytest.fixture(scope="module")
def shared():
    return []

def test_it(shared):
    assert not shared
    shared.append(1)
    runs.append(1)
    if {starve}:
        conftest.monitor.add(0.5, 0.3)
    assert len(runs) >= {passes_at}

def test_the_shared_fixture_is_kept_without_a_failure(shared):
    assert shared
"""


@pytest.mark.parametrize(
    ("starve", "passes_at", "outcome"),
    [
        (True, 2, {"passed": 2, "repeated": 1}),
        (True, 3, {"passed": 2, "repeated": 2}),
        (True, 4, {"failed": 1, "passed": 1, "repeated": 2}),
        (False, 2, {"failed": 1, "passed": 1}),
    ],
)
def test_only_a_starved_test_is_repeated(pytester, monkeypatch, starve, passes_at, outcome):
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    pytester.makeconftest(CONFTEST)
    pytester.makepyfile(STARVED_OR_NOT.format(starve=starve, passes_at=passes_at))
    result = pytester.runpytest_subprocess("--rootdir", str(pytester.path))
    assert result.parseoutcomes() == outcome
    assert ("repeated, because" in result.stdout.str()) == starve


def test_the_names_of_starved_tests_are_written_if_they_are_repeated_later(pytester, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    pytester.makeconftest(CONFTEST)
    first_test, _ = STARVED_OR_NOT.format(starve=True, passes_at=2).split("def test_the_shared")
    path = pytester.makepyfile(first_test)
    arguments = "--rootdir", str(pytester.path)
    result = pytester.runpytest_subprocess(*arguments, "--repeat-later", "names")
    assert result.ret == 0
    assert "to be repeated later" in result.stdout.str()
    assert (pytester.path / "names").read_text() == f"{path.name}::test_it\n"
    assert pytester.runpytest_subprocess(*arguments, "@names").parseoutcomes() == {"passed": 1, "repeated": 1}


def test_the_text_of_each_failure_is_written_once(pytester, monkeypatch):
    """The output of all tests ends with this file, because the end of a long output is what people read."""
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    pytester.makeconftest(CONFTEST)
    path = pytester.makepyfile("def test_it():\n    print('a value')\n    assert 1 == 2\n")
    for processes in ("0", "2"):
        pytester.runpytest_subprocess("--rootdir", str(pytester.path), "-n", processes, "--failures", "texts")
    texts = (pytester.path / "texts").read_text()
    assert texts.count(f"FAILED {path.name}::test_it (call)") == 2
    assert texts.count("E       assert 1 == 2") == texts.count("a value\n") == 2


@pytest.mark.parametrize(
    ("loop_s", "load", "processes"),
    [
        (1e-3, 0.0, 5), (1e-3, 3.0, 5), (1e-3, 4.5, 4), (1e-3, 6.0, 2), (1e-3, 20.0, 2),
        (5e-3, 0.0, 4), (8e-3, 0.0, 3), (80e-3, 0.0, 3), (8e-3, 20.0, 2),
    ],
)  # fmt: skip
def test_the_number_of_processes_depends_on_the_speed_and_on_the_load(monkeypatch, loop_s, load, processes):
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    monkeypatch.setattr(os, "getloadavg", lambda: (load, 0.0, 0.0))
    monkeypatch.setattr(conftest, "loop_s", lambda: loop_s)
    config = SimpleNamespace(getoption={"--time": "real"}.get)
    assert conftest.pytest_xdist_auto_num_workers(config) == processes


def test_the_list_of_tests_in_real_time_names_existing_files():
    assert all(path.exists() for path in conftest.real_time_paths + conftest.virtual_time_paths)


def test_each_test_that_starts_an_instrument_or_a_timer_is_in_real_time():
    wrong = [
        name_of(path)
        for path in TESTS
        if path.name.startswith("test_") and not conftest.is_in_real_time(path)
        if _called_names(path) & {"simulated_rig", "start_instrument", "Timer"}
    ]
    assert not wrong


def _called_names(path):
    calls = [node.func for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Call)]
    return {getattr(func, "attr", None) or getattr(func, "id", None) for func in calls}
