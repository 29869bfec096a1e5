"""Tests of the limits of the log, in virtual time."""

import logging
import os
import subprocess
import sys

import pytest

from pneuforce.instrument.core.controller import Instrument
from pneuforce.instrument.core.faults import HostFault
from pneuforce.instrument.core.settings import Settings
from pneuforce.instrument.core.state import STATE_LOGGER
from pneuforce.instrument.service.stderr_log import INFORMATION, STATE, WARNINGS, LogQueue
from pneuforce.registers.source import Peer

PLC = Peer("modbus_tcp", "10.0.0.5")
JOURNALD_LINES, JOURNALD_S = 10_000, 30  #: default limit of journald (journald.conf, RateLimitBurst)
KINDS = [
    ("pneuforce", logging.INFO, INFORMATION),
    ("pneuforce.registers.modbus.tcp", logging.WARNING, WARNINGS),
    ("asyncio", logging.ERROR, WARNINGS),
    (STATE_LOGGER, logging.INFO, STATE),
    (STATE_LOGGER, logging.WARNING, STATE),
]


class Log:
    """Log queue in virtual time that receives all records of this process."""

    def __init__(self):
        self.now_s = 1000.0
        self.queue = LogQueue(lambda: self.now_s)

    def lines(self):
        """Remove and return the lines that wait for the writing thread."""
        return [self.queue.queue.get().getMessage() for _ in range(self.queue.queue.qsize())]

    def flood(self, name, level, per_s, seconds):
        """Log lines at a constant rate. Return the lines that passed."""
        passed = []
        for n in range(round(per_s * seconds)):
            self.now_s += 1 / per_s
            logging.getLogger(name).log(level, "line %d", n)
            passed += self.lines()
        return passed


@pytest.fixture
def log(monkeypatch):
    root, log = logging.getLogger(), Log()
    monkeypatch.setattr(root, "handlers", [log.queue])
    monkeypatch.setattr(logging.getLogger("asyncio"), "disabled", False)
    level = root.level
    root.setLevel(logging.INFO)
    yield log
    root.setLevel(level)


@pytest.mark.parametrize(("name", "level", "limit"), KINDS)
def test_each_kind_of_line_has_its_limit_and_the_dropped_lines_are_counted(log, name, level, limit):
    passed = log.flood(name, level, per_s=1000, seconds=10)
    assert len(passed) == pytest.approx(11 * limit.per_s, rel=0.01)
    dropped = sum(int(line.split("(")[1].split()[0]) for line in passed if "dropped before" in line)
    assert dropped + len(passed) == pytest.approx(10_000, abs=1000 / limit.per_s)
    log.now_s += 1.0
    assert len(log.flood(name, level, limit.per_s, 1)) == limit.per_s


def test_a_trip_is_logged_though_a_peer_writes_changing_values_200_times_per_second(log):
    instrument = Instrument(Settings())
    trips = 0
    for n in range(1200):
        log.now_s += 0.005
        instrument.write(PLC, {"force_limit_n": 1.0 + n / 1000}, log.now_s)
        if n % 200 == 199:
            instrument.faults.clear(set(instrument.faults))
            instrument.trip(HostFault.LINK_LOST)
            trips += 1
    assert sum("tripped" in line for line in log.lines()) == trips


def test_neither_information_nor_warnings_displace_a_trip_if_stderr_accepts_no_bytes(log):
    for _ in range(100):
        log.now_s += 1.0
        for name, level, _ in KINDS[:3]:
            for n in range(60):
                logging.getLogger(name).log(level, "line %d", n)
    assert log.queue.queue.qsize() == WARNINGS.max_waiting
    for fault in HostFault:
        log.now_s += 0.01
        Instrument(Settings()).trip(fault)
    assert sum("tripped" in line for line in log.lines()) == len(HostFault)


def test_all_limits_together_stay_below_the_limit_of_journald():
    limits = (INFORMATION, WARNINGS, STATE)
    assert sum(limit.per_s * (JOURNALD_S + 1) for limit in limits) < JOURNALD_LINES


def test_a_line_with_an_invalid_file_name_is_logged_and_the_next_line_too():
    program = (
        "import logging, os\n"
        "from pneuforce.instrument.service.stderr_log import log_to_stderr\n"
        "with log_to_stderr():\n"
        "    logging.info('file %s', os.fsdecode(b'\\xff'))\n"
        "    logging.info('next')\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, check=True)
    assert len(done.stderr.splitlines()) == 2, os.fsdecode(done.stderr)


def test_a_message_with_control_characters_is_one_printable_line():
    """Otherwise text from the network could forge lines, for example an anchor of the event log."""
    program = (
        "import logging\n"
        "from pneuforce.instrument.service.stderr_log import log_to_stderr\n"
        "with log_to_stderr():\n"
        "    logging.info('hub: %s', 'x\\x1b[2J\\r\\n12:00:00 event log: \\u2028\\u202e')\n"
        "    try:\n"
        "        raise ValueError('x\\x1b[2J')\n"
        "    except ValueError:\n"
        "        logging.exception('failed')\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, check=True, text=True)
    assert all(line.isprintable() for line in done.stderr.split("\n"))
    first, second, *traceback = done.stderr.splitlines()
    assert ("event log" in first, "failed" in second, len(traceback) >= 3) == (True, True, True)
