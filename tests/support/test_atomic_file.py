"""Tests of file access: a file is read completely or rejected, and is written completely or not at all."""

import os
from pathlib import Path

import pytest

from pneuforce.errors import ConfigurationError
from pneuforce.support.atomic_file import MAX_BYTES, check_writable, read_file, write_lines

ENDLESS = ["/dev/zero", "/dev/full", "/dev/tty", "/dev"]


def test_a_written_file_is_read_unchanged(tmp_path):
    write_lines(tmp_path / "a", ["ΔP\n", "2\n"])
    assert read_file(tmp_path / "a") == "ΔP\n2\n".encode()
    assert os.listdir(tmp_path) == ["a"]


@pytest.mark.parametrize("path", ENDLESS)
def test_a_device_is_neither_read_nor_replaced(path):
    for act in (read_file, check_writable, lambda path: write_lines(path, [])):
        with pytest.raises(ConfigurationError, match=r"not a regular file|a folder"):
            act(Path(path))
    assert not Path(path).is_file()


def test_a_pipe_is_rejected_without_waiting(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for act in (read_file, check_writable):
        with pytest.raises(ConfigurationError, match=r"not a regular file|a folder"):
            act(tmp_path / "pipe")


def test_a_missing_file_is_reported_with_a_remedy(tmp_path):
    with pytest.raises(ConfigurationError, match=r"absent: no such file \(make one\)"):
        read_file(tmp_path / "absent", "make one")


def test_a_huge_file_is_not_read(tmp_path):
    with (tmp_path / "huge").open("wb") as file:
        file.truncate(MAX_BYTES + 1)
    with pytest.raises(ConfigurationError, match="100 MB"):
        read_file(tmp_path / "huge")


def test_the_check_for_write_access_does_not_change_the_file(tmp_path):
    (tmp_path / "a").write_text("old")
    check_writable(tmp_path / "a")
    assert (tmp_path / "a").read_text() == "old"
    assert os.listdir(tmp_path) == ["a"]
    with pytest.raises(
        ConfigurationError, match=r"cannot be written: .*: create the folder .*, or name another"
    ):
        check_writable(tmp_path / "absent" / "a")
