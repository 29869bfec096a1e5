"""Settings for all tests, and the repetition of real-time tests that got too little processor time."""

import signal
from pathlib import Path

import pytest

from tests.starvation import StarvationMonitor

# A background job of a shell ignores Ctrl-C, and every program that a test starts would inherit this setting.
signal.signal(signal.SIGINT, signal.default_int_handler)

ROOT = Path(__file__).parents[1]
#: Folders and files with tests that start processes or wait in real time. All others use virtual time.
REAL_TIME = [
    ROOT / name
    for name in (
        "docs/examples",
        "tests/bench",
        "tests/hostile",
        "tests/instrument/audit",
        "tests/instrument/service",
        "tests/peers",
        "tests/registers/can",
        "tests/registers/canopen",
        "tests/registers/modbus",
        "tests/sim/line",
        "tests/sim/server",
        "tests/system",
        "tests/teststand",
        "tests/web",
    )
]
monitor = StarvationMonitor()


def pytest_configure():
    monitor.start()


def pytest_unconfigure():
    monitor.stop()


def pytest_collection_modifyitems(items):
    """Allow one repetition of a real-time test, if a lack of processor time explains its failure."""
    for item in items:
        if any(item.path.is_relative_to(folder) for folder in REAL_TIME):
            item.add_marker(pytest.mark.flaky(reruns=1, condition=lambda: monitor.starved))


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup():
    monitor.restart()


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport():
    """Write the longest wait for a processor into the report of a failed test."""
    report = (yield).get_result()
    if report.failed:
        report.user_properties.append(("waited_s", round(monitor.longest_s, 2)))


def pytest_terminal_summary(terminalreporter):
    """Print the names of the tests that were repeated."""
    for report in terminalreporter.stats.get("rerun", []):
        waited_s = dict(report.user_properties)["waited_s"]
        terminalreporter.write_line(
            f"repeated once, because it waited {waited_s} s for a processor: {report.nodeid} ({report.when})"
        )
