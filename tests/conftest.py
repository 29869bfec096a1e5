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
    "docs/examples",
    "tests/bench",
    "tests/hostile",
    "tests/instrument/audit/test_damaged_files.py",
    "tests/instrument/audit/test_writer.py",
    "tests/instrument/service",
    "tests/peers",
    "tests/registers/can/test_bus.py",
    "tests/registers/can/test_connection.py",
    "tests/registers/can/test_hub.py",
    "tests/registers/can/test_hub_clients.py",
    "tests/registers/can/test_socketcand_bus.py",
    "tests/registers/modbus/test_allow.py",
    "tests/registers/modbus/test_client.py",
    "tests/registers/modbus/test_open_file_limit.py",
    "tests/registers/modbus/test_properties.py",
    "tests/registers/modbus/test_rtu_server.py",
    "tests/registers/modbus/test_tcp.py",
    "tests/registers/modbus/test_tcp_limits.py",
    "tests/sim/line",
    "tests/sim/server",
    "tests/support/test_background.py",
    "tests/system",
    "tests/teststand",
    "tests/web",
]
#: Tests in these folders that use virtual time.
VIRTUAL_TIME = [
    "tests/sim/line/test_line_noise.py",
    "tests/system/test_accuracy.py",
    "tests/system/test_accuracy_document.py",
    "tests/system/test_calibrate.py",
    "tests/system/test_links.py",
    "tests/system/test_model_document.py",
    "tests/system/test_plot.py",
    "tests/system/test_shell_blocks.py",
    "tests/system/test_validate.py",
    "tests/system/test_validated_recording.py",
    "tests/teststand/test_observer.py",
    "tests/web/test_browser_feed.py",
    "tests/web/test_decimation.py",
    "tests/web/test_http_requests.py",
    "tests/web/test_request_guard.py",
]
real_time_paths = [ROOT / name for name in REAL_TIME]
virtual_time_paths = [ROOT / name for name in VIRTUAL_TIME]
monitor = StarvationMonitor()


def pytest_configure(config):
    config.addinivalue_line("markers", "real_time: starts processes or waits in real time; set by folder")
    monitor.start()


def pytest_unconfigure():
    monitor.stop()


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Mark the tests in real time, and allow one repetition of each if starvation explains a failure."""
    for item in items:
        in_real_time = any(item.path.is_relative_to(path) for path in real_time_paths)
        if in_real_time and item.path not in virtual_time_paths:
            item.add_marker(pytest.mark.real_time)
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
