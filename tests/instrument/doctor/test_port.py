"""What Linux says of a port, on files laid out as Linux does, and on real ptys."""

import os

import pytest

from instrument.doctor.check import Verdict
from instrument.doctor.port import INSTALL_RULES, port_checks
from instrument.rig.device import RULES, holders, stable_name, usb_latency_ms


@pytest.fixture
def pty():
    ends = os.openpty()
    yield os.ttyname(ends[1])
    for end in ends:
        os.close(end)


def test_a_port_that_is_not_there_is_bad_and_nothing_else_is_asked(tmp_path):
    first, *others = port_checks(str(tmp_path / "absent"))
    assert first.verdict is Verdict.BAD
    assert {check.verdict for check in others} == {Verdict.NOT_CHECKED}


@pytest.mark.parametrize("other", ["/dev/null", "/dev/zero", "/etc/passwd", "/tmp"])
def test_what_is_no_serial_port_is_bad_and_called_so(other):
    first, *others = port_checks(other)
    assert (first.verdict, first.found) == (Verdict.BAD, f"{other} is not a serial port")
    assert {check.verdict for check in others} == {Verdict.NOT_CHECKED}


def test_the_rule_that_is_to_be_installed_is_there():
    assert RULES.is_file()
    assert str(RULES) in INSTALL_RULES


def test_of_a_port_behind_the_network_nothing_is_known():
    assert {check.verdict for check in port_checks("socket://10.0.0.1:4000")} == {Verdict.NOT_CHECKED}


def test_a_free_pty_is_good(pty):
    verdicts = {check.name: check.verdict for check in port_checks(pty)}
    assert [verdicts[name] for name in ("port", "permission", "exclusive access")] == [Verdict.GOOD] * 3


@pytest.fixture
def processes(tmp_path, pty):
    def process(pid, name, *opened):
        folder = tmp_path / str(pid)
        (folder / "fd").mkdir(parents=True)
        (folder / "comm").write_text(name + "\n")
        for number, path in enumerate(opened):
            (folder / "fd" / str(number)).symlink_to(path)

    process(77, "ModemManager", "/dev/null", pty)
    process(78, "simulator", "/dev/ptmx", pty)
    process(79, "other", "/dev/null")
    process(os.getpid(), "ourselves", pty)
    (tmp_path / "80").mkdir()  # has ended meanwhile
    return tmp_path


def test_who_has_a_port_open_is_named_but_for_ourselves_and_a_ptys_far_end(processes, pty):
    assert holders(pty, processes) == ["ModemManager (77)"]


def test_the_name_that_follows_an_adapter_is_found_from_any_other(tmp_path, pty):
    (tmp_path / "usb-Arduino_Uno-if00").symlink_to(pty)
    (tmp_path / "usb-Another-if00").symlink_to("/dev/null")
    assert stable_name(pty, tmp_path) == tmp_path / "usb-Arduino_Uno-if00"
    assert stable_name("/dev/zero", tmp_path) is None
    assert stable_name(pty, tmp_path / "absent") is None


@pytest.mark.parametrize(("text", "latency_ms"), [("16\n", 16), ("1\n", 1), ("none", None)])
def test_the_latency_timer_of_an_adapter_is_read_where_it_has_one(tmp_path, pty, text, latency_ms):
    folder = tmp_path / os.path.basename(pty)
    folder.mkdir()
    (folder / "latency_timer").write_text(text)
    assert usb_latency_ms(pty, tmp_path) == latency_ms
    assert usb_latency_ms("/dev/ttyACM0", tmp_path) is None
