"""Settings for all tests, and the repetition of real-time tests that got too little processor time."""

import contextlib
import os
import signal
import statistics
import time
import timeit
from functools import cache
from pathlib import Path

import pytest
from _pytest.runner import runtestprotocol

from tests.starvation import StarvationMonitor

# A background job of a shell ignores Ctrl-C, and every program that a test starts would inherit this setting.
signal.signal(signal.SIGINT, signal.default_int_handler)

ROOT = Path(__file__).parents[1]
#: Folders and files with tests that start processes or wait in real time. All others use virtual time.
REAL_TIME = [
    "docs/examples",
    "tests/attack/test_attack_in_real_time.py",
    "tests/bench",
    "tests/client/test_can_receiver.py",
    "tests/client/test_end_of_hold.py",
    "tests/client/test_examples.py",
    "tests/client/test_fall_of_the_force.py",
    "tests/client/test_instrument.py",
    "tests/client/test_lost_connection.py",
    "tests/client/test_old_samples.py",
    "tests/client/test_stopped_program.py",
    "tests/hostile",
    "tests/instrument/audit/test_anchors.py",
    "tests/instrument/audit/test_damaged_files.py",
    "tests/instrument/audit/test_writer.py",
    "tests/instrument/config/test_instruments_on_one_host.py",
    "tests/instrument/config/test_start_checks.py",
    "tests/instrument/service",
    "tests/mqtt/test_broker.py",
    "tests/node_red",
    "tests/peers",
    "tests/registers/can/test_bus.py",
    "tests/registers/can/test_connection.py",
    "tests/registers/can/test_hub.py",
    "tests/registers/can/test_hub_clients.py",
    "tests/registers/can/test_hub_foreign_clients.py",
    "tests/registers/can/test_last_frame.py",
    "tests/registers/can/test_socketcand_bus.py",
    "tests/registers/modbus/test_allow.py",
    "tests/registers/modbus/test_client.py",
    "tests/registers/modbus/test_open_file_limit.py",
    "tests/registers/modbus/test_properties.py",
    "tests/registers/modbus/test_rtu_server.py",
    "tests/registers/modbus/test_tcp.py",
    "tests/registers/modbus/test_tcp_limits.py",
    "tests/registers/modbus_security/test_gateway.py",
    "tests/release/test_package_installation.py",
    "tests/ros",
    "tests/sim/line",
    "tests/sim/server",
    "tests/sim/test_fault_control.py",
    "tests/support/test_background.py",
    "tests/support/test_serial_port.py",
    "tests/system",
    "tests/teststand",
    "tests/web",
]
#: Tests in these folders that use virtual time.
VIRTUAL_TIME = [
    "tests/instrument/service/host/test_command_gaps.py",
    "tests/instrument/service/processes/test_web_libraries.py",
    "tests/ros/test_diagnosis.py",
    "tests/ros/test_package.py",
    "tests/sim/line/test_line_noise.py",
    "tests/system/test_accuracy.py",
    "tests/system/test_accuracy_document.py",
    "tests/system/test_calibrate.py",
    "tests/system/test_links.py",
    "tests/system/test_model_document.py",
    "tests/system/test_plot.py",
    "tests/system/test_security_page.py",
    "tests/system/test_shell_blocks.py",
    "tests/system/test_validate.py",
    "tests/system/test_validated_recording.py",
    "tests/teststand/test_demo_sequence.py",
    "tests/web/server/test_admission.py",
    "tests/web/test_browser_feed.py",
    "tests/web/test_decimation.py",
    "tests/web/test_earlier_events.py",
    "tests/web/test_event_stream_places.py",
    "tests/web/server/test_eviction.py",
    "tests/web/server/test_http_requests.py",
    "tests/web/test_metrics.py",
    "tests/web/test_operator_texts.py",
    "tests/web/login/test_login_limiter.py",
    "tests/web/server/test_request_pacer.py",
    "tests/web/test_request_guard.py",
    "tests/web/login/test_sessions.py",
    "tests/web/test_vendored_files.py",
]
#: Files with a long run time. They run first, so that no process runs such a file alone at the end.
LONG = [
    "tests/bench/test_bench.py",
    "tests/web/test_in_the_browser.py",
    "tests/web/test_vent_in_a_crowd.py",
    "tests/system/test_readme.py",
    "tests/system/test_demo.py",
    "tests/web/test_web_process.py",
    "tests/system/test_accuracy.py",
    "tests/instrument/test_occlusion.py",
    "tests/rules/test_rules.py",
]
real_time_paths = [ROOT / name for name in REAL_TIME]
virtual_time_paths = [ROOT / name for name in VIRTUAL_TIME]
#: Two processors get five processes for tests in real time if `loop_s` is below this time [s]. Where it was
#: 7e-3 to 10e-3, five processes starved 54 tests in 44 minutes, and three processes 16 tests in 29 minutes,
#: both with the tests in virtual time beside them.
FAST_LOOP_S = 4e-3
#: Largest number of repetitions of a test that was starved in each run before.
MAX_REPETITIONS = 2
MAX_FAILURE_CHARACTERS = 3000  #: end of each text of a failure that is printed again
monitor = StarvationMonitor()
#: Files in which a test was starved. The tests of a file can share an instrument that tripped at that time.
starved_files = set()


@cache
def is_in_real_time(path):
    """Return True for a file in real time. Thousands of tests ask this question about a few files."""
    return path not in virtual_time_paths and any(path.is_relative_to(p) for p in real_time_paths)


@cache
def name_of(path):
    """Return the path of a file within this repository."""
    return path.relative_to(ROOT).as_posix() if path.is_relative_to(ROOT) else ""


def pytest_addoption(parser):
    parser.addoption(
        "--time", choices=("real", "virtual"), help="run only the tests in real or in virtual time"
    )
    parser.addoption(
        "--repeat-later", type=Path, metavar="FILE", help="do not repeat starved tests, but write their names"
    )
    parser.addoption(
        "--failures", type=Path, metavar="FILE", help="append the text of each failure to this file"
    )


@pytest.hookimpl(optionalhook=True)  # the mutation tests run without xdist
def pytest_xdist_auto_num_workers(config):
    """Return the number of processes for `-n auto`.

    Tests in real time mostly wait, so they can share a processor. Beside other work, or on slow processors,
    they would starve.
    """
    processors = os.cpu_count() or 1
    if config.getoption("--time") == "virtual":
        return processors
    busy = max(0.0, os.getloadavg()[0] - 1.5 * processors)
    shared = min(max(1.5, 2.5 * FAST_LOOP_S / loop_s()), 2.5)
    return max(2, round(shared * processors - busy))


def loop_s():
    """Return the median processor time [s] of a fixed loop."""
    return statistics.median(
        timeit.repeat("for i in range(100_000): i * i", timer=time.process_time, number=1, repeat=5)
    )


def pytest_configure(config):
    config.addinivalue_line("markers", "real_time: starts processes or waits in real time; set by folder")
    with contextlib.suppress(ImportError):  # make test-ros runs without Hypothesis
        set_hypothesis_profile()


def set_hypothesis_profile():
    """Let the examples of Hypothesis take any time, because a slow computer is no error of the product."""
    from hypothesis import HealthCheck, settings

    settings.register_profile("any speed", deadline=None, suppress_health_check=[HealthCheck.too_slow])
    settings.load_profile("any speed")


def is_selected(path, config):
    wanted = config.getoption("--time")
    return wanted is None or is_in_real_time(path) == (wanted == "real")


def pytest_ignore_collect(collection_path, config):
    """Import no file that `--time` does not select."""
    return True if collection_path.suffix == ".py" and not is_selected(collection_path, config) else None


@pytest.hookimpl(trylast=True)
def pytest_collection_finish(session):
    """Start measuring, if a test in real time is selected."""
    if any(item.get_closest_marker("real_time") for item in session.items):
        monitor.start()


def pytest_unconfigure():
    monitor.stop()


def pytest_collection_modifyitems(items, config):
    """Mark the tests in real time. Select here, too: `pytest_ignore_collect` covers only this folder."""
    items[:] = [item for item in items if is_selected(item.path, config)]
    items.sort(key=lambda item: LONG.index(name) if (name := name_of(item.path)) in LONG else len(LONG))
    for item in items:
        if is_in_real_time(item.path):
            item.add_marker(pytest.mark.real_time)


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_protocol(item, nextitem):
    """Run a test in real time. Repeat the test if a lack of processor time explains its failure.

    Tests of one file can share an instrument, so an earlier starved test of the file counts, too. The next
    test gets new fixtures of every scope, because the failure can have changed the old ones.
    """
    if item.get_closest_marker("real_time") is None:
        return None
    item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
    reports = run_measured(item, nextitem)
    if monitor.starved:
        starved_files.add(item.path)
    explained = item.path in starved_files
    repetitions = 0 if item.config.getoption("--repeat-later") else MAX_REPETITIONS
    while explained and (failures := [report for report in reports if report.failed]):
        report_repetition(item, failures[0], monitor.longest_s)
        with contextlib.suppress(Exception):  # for example of an instrument that has ended
            item.session._setupstate.teardown_exact(None)
        reports = []
        if repetitions:
            item._initrequest()
            reports = run_measured(item, nextitem)
        repetitions -= 1
        explained = monitor.starved and repetitions > 0
    for report in reports:
        item.ihook.pytest_runtest_logreport(report=report)
    item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
    return True


def run_measured(item, nextitem):
    """Run a test once. Return its reports. The monitor has then measured this run only."""
    monitor.restart()
    return runtestprotocol(item, log=False, nextitem=nextitem)


def report_repetition(item, failure, waited_s):
    failure.outcome = "repeated"
    failure.user_properties.append(("waited_s", round(waited_s, 2)))
    item.ihook.pytest_runtest_logreport(report=failure)


def pytest_report_teststatus(report):
    return ("repeated", "R", "REPEATED") if report.outcome == "repeated" else None


def pytest_terminal_summary(terminalreporter, config):
    """Print the names of the starved tests, and the reason. Write the names if they are repeated later."""
    starved = terminalreporter.stats.get("repeated", [])
    file = config.getoption("--repeat-later")
    repeated = "to be repeated later" if file else "repeated"
    for report in starved:
        waited_s = dict(report.user_properties)["waited_s"]
        error = str(report.longrepr).strip().splitlines()[-1]
        terminalreporter.write_line(
            f"{repeated}, because it waited {waited_s} s for processors or the disk: {report.nodeid} "
            f"({report.when}: {error})"
        )
    if file:
        file.write_text("".join(f"{report.nodeid}\n" for report in starved), encoding="utf-8")
    failures = config.getoption("--failures")
    if failures and not hasattr(config, "workerinput"):  # the processes of xdist have this option, too
        append_failures(failures, terminalreporter.stats)


def append_failures(file, stats):
    """Append the end of the text of each failure to a file, with what the test printed."""
    with file.open("a", encoding="utf-8") as output:
        for report in [*stats.get("failed", []), *stats.get("error", [])]:
            output.write(f"\nFAILED {report.nodeid} ({getattr(report, 'when', 'collect')})\n")
            for text in (report.longreprtext, report.capstdout, report.capstderr, report.caplog):
                output.write(text[-MAX_FAILURE_CHARACTERS:].rstrip() + "\n" if text else "")
