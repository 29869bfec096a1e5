"""Tests of the files that a simulator creates: the link to its port, and the file with its control port."""

import fcntl
import os
import signal
import stat
from threading import Timer

import pytest

from pneuforce.errors import PortUnavailable, RigError
from pneuforce.instrument.cli.sim.fault import control_port_of
from pneuforce.instrument.cli.terminal.exit_codes import ExitCode
from pneuforce.sim.line.pty_link import PtyLink
from pneuforce.sim.server.port_file import LOCK_RETRY_S, port_file
from pneuforce.support.serial_port import SerialPort
from tests.command_runner import pneuforce
from tests.sim.server.test_sim_server import simulator

PRECIOUS = "precious\n"


def regular(path, content=PRECIOUS):
    path.write_text(content)


def symlink_to_a_file(path):
    regular(path.with_name("precious"))
    path.symlink_to("precious")


def symlink_to_a_port_file(path):
    regular(path.with_name("precious"), "12345\n")
    path.symlink_to("precious")


def hard_link(path):
    regular(path.with_name("precious"), "12345\n")
    path.hardlink_to(path.with_name("precious"))


FOREIGN = {
    "symbolic link": symlink_to_a_file,
    "symbolic link to a number": symlink_to_a_port_file,
    "dangling symbolic link": lambda path: path.symlink_to("missing"),
    "hard link": hard_link,
    "text": regular,
    "long number": lambda path: regular(path, "123456\n"),
    "number and text": lambda path: regular(path, "12345\nprecious\n"),
    "number without an end of line": lambda path: regular(path, "12345"),
    "folder": lambda path: path.mkdir(),
    "pipe": lambda path: os.mkfifo(path),
}
LINKS = {
    "text": regular,
    "symbolic link": symlink_to_a_file,
    "symbolic link to a folder": lambda path: path.symlink_to("."),
    "dangling symbolic link": lambda path: path.symlink_to("missing"),
    "symbolic link to a device": lambda path: path.symlink_to("/dev/null"),
    "hard link": hard_link,
    "folder": lambda path: path.mkdir(),
    "pipe": lambda path: os.mkfifo(path),
}


def state_of(folder):
    """Return what the folder contains: names, types, link targets and contents."""
    return {
        path.name: (
            stat.S_IFMT(path.lstat().st_mode),
            path.lstat().st_ino,
            os.readlink(path) if path.is_symlink() else "",
            path.read_bytes() if path.is_file() else b"",
        )
        for path in folder.iterdir()
    }


def assert_rejected(tmp_path, link="rig"):
    before = state_of(tmp_path)
    done = pneuforce("sim", "run", "--link", link, cwd=tmp_path, timeout_s=60)
    assert (done.returncode, done.stdout) == (ExitCode.UNAVAILABLE, "")
    assert done.stderr.startswith("pneuforce: the simulator cannot start: ")
    assert len(done.stderr.splitlines()) == 1
    assert state_of(tmp_path) == before
    return done.stderr


@pytest.mark.parametrize("kind", FOREIGN)
def test_a_control_file_that_no_simulator_has_created_stops_the_start_and_is_kept(tmp_path, kind):
    FOREIGN[kind](tmp_path / "rig.control")
    assert "--link" in assert_rejected(tmp_path)


@pytest.mark.parametrize("kind", LINKS)
def test_a_link_that_no_simulator_has_created_stops_the_start_and_is_kept(tmp_path, kind):
    LINKS[kind](tmp_path / "rig")
    assert "--link" in assert_rejected(tmp_path)


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give a file to another user")
def test_a_control_file_of_another_user_is_kept(tmp_path):
    regular(tmp_path / "rig.control", "12345\n")
    os.chown(tmp_path / "rig.control", 12345, 12345)
    assert_rejected(tmp_path)


@pytest.mark.parametrize("link", [".", "/", "", "missing/rig", "x" * 300, "/proc/rig"])
def test_a_path_that_cannot_be_a_link_is_reported_in_one_line(tmp_path, link):
    assert_rejected(tmp_path, link)


@pytest.mark.parametrize("stale", ["12345\n", ""])
def test_the_files_of_a_killed_simulator_are_replaced(tmp_path, stale):
    regular(tmp_path / "rig.control", stale)
    (tmp_path / "rig").symlink_to("/dev/pts/987654")
    with simulator(tmp_path / "rig") as (_, ports):
        assert os.readlink(tmp_path / "rig") == ports["port"]
        assert (tmp_path / "rig.control").read_text() == f"{ports['control']}\n"
    assert list(tmp_path.iterdir()) == []


def test_the_link_of_a_killed_simulator_is_never_opened_even_if_its_port_has_a_new_owner(tmp_path):
    link, others = tmp_path / "rig", os.openpty()
    try:
        with simulator(link) as (process, _):
            SerialPort(str(link)).close()
            control_port_of(link)
            process.kill()
            process.wait(60)
            link.unlink()
            link.symlink_to(os.ttyname(others[1]))  # the system gives a free name to the next program
            with pytest.raises(
                PortUnavailable, match=r"was killed, and /dev/pts/.* Start the simulator again"
            ):
                SerialPort(str(link))
            with pytest.raises(RigError, match="no simulator has its port"):
                control_port_of(link)
        with simulator(link):
            SerialPort(str(link)).close()
    finally:
        for end in others:
            os.close(end)


def test_a_simulator_starts_while_another_program_checks_its_link(tmp_path):
    (tmp_path / "rig.control").touch()
    with open(tmp_path / "rig.control") as checked:
        fcntl.flock(checked, fcntl.LOCK_SH)
        Timer(LOCK_RETRY_S, checked.close).start()
        with port_file(tmp_path / "rig", 5000):
            assert (tmp_path / "rig.control").read_text() == "5000\n"


def test_other_users_cannot_write_the_control_file_even_if_the_umask_allows_it(tmp_path):
    before = os.umask(0)
    try:
        with port_file(tmp_path / "rig", 5000):
            mode = (tmp_path / "rig.control").stat().st_mode
    finally:
        os.umask(before)
    assert stat.S_IMODE(mode) == 0o644


def test_files_that_replaced_those_of_a_running_simulator_are_kept(tmp_path):
    with simulator(tmp_path / "rig") as (process, _):
        for name in ("rig", "rig.control"):
            (tmp_path / name).unlink()
        symlink_to_a_file(tmp_path / "rig")
        symlink_to_a_port_file(tmp_path / "rig.control")
        before = state_of(tmp_path)
        process.send_signal(signal.SIGTERM)
        process.wait(60)
        assert state_of(tmp_path) == before


def test_a_link_that_appears_while_the_cable_is_unplugged_is_kept(tmp_path):
    cable = PtyLink(tmp_path / "rig")
    cable.unplug()
    symlink_to_a_file(tmp_path / "rig")
    before = state_of(tmp_path)
    with pytest.raises(FileExistsError):
        cable.plug()
    cable.close()
    assert state_of(tmp_path) == before


@pytest.mark.parametrize("content", ["99999\n", "0\n", "-1\n", "1" * 5000, "\x00", "²\n"])
def test_an_invalid_control_file_is_reported_in_one_line(tmp_path, content):
    regular(tmp_path / "rig.control", content)
    done = pneuforce("sim", "fault", "--link", "rig", cwd=tmp_path)
    assert (done.returncode, done.stdout, len(done.stderr.splitlines())) == (69, "", 1)
    assert "rig" in done.stderr


def test_a_pipe_in_place_of_the_control_file_does_not_block(tmp_path):
    os.mkfifo(tmp_path / "rig.control")
    done = pneuforce("sim", "fault", "--link", "rig", cwd=tmp_path, timeout_s=60)
    assert (done.returncode, len(done.stderr.splitlines())) == (69, 1)
