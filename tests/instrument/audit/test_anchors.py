"""Tests of anchors: lines in the journal that show whether an event log was cut, rewritten or replaced.

The logs are real files. The journal contains the lines of the writer among other lines.
"""

import io
import json
import logging
import shutil
import subprocess
import sys
import time

import pytest

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.audit.anchor import Anchor, check_anchors, find_anchors, format_anchor
from pneuforce.instrument.audit.verification import BrokenChainError
from pneuforce.instrument.audit.writer import EventLogWriter
from pneuforce.instrument.cli.log.verification import Verification, verify_events
from tests.command_runner import pneuforce
from tests.instrument.audit.event_log_files import make_log, make_record, verify_log

TIMEOUT_S = 20.0
AT = "2027-01-31T08:00:00.000000Z"


def wait_until(condition):
    until_s = time.monotonic() + TIMEOUT_S
    while not condition():
        assert time.monotonic() < until_s, "the condition was not reached in time"
        time.sleep(0.01)


@pytest.fixture
def journal(caplog, tmp_path):
    """Return a function that writes all log messages to a file, as `journalctl` prints them."""
    caplog.set_level(logging.INFO, "pneuforce")

    def write():
        prefix = "Nov 22 15:31:00 host pneuforce[123]: 15:31:00"
        lines = [f"{prefix} can0 wrote setpoint 8", *(f"{prefix} {message}" for message in caplog.messages)]
        (tmp_path / "journal").write_text("\n".join([*lines, f"{prefix} zero taken"]))
        return tmp_path / "journal"

    return write


@pytest.fixture(autouse=True)
def long_close_timeout(monkeypatch):
    """Increase the time limit of `close`, because the disk may be busy during the tests."""
    monkeypatch.setattr("pneuforce.instrument.audit.writer.CLOSE_S", TIMEOUT_S)


def verify_noted(file, *noted, **others):
    return verify_events(file, Verification(noted=noted, **others), as_json=True)


def test_a_noted_head_is_in_the_log_until_a_record_before_it_is_changed(tmp_path, capsys):
    file, other = make_log(tmp_path / "log", range(9)), make_log(tmp_path / "other", range(1, 10))
    digest = verify_log(make_log(tmp_path / "first", range(5))).head
    assert verify_noted(file, f"5:{digest[:8]}", f"5:{digest[:16].upper()}", f"5:{digest}") == 0
    assert json.loads(capsys.readouterr().out)["noted"] == 3
    assert verify_noted(file, f"4:{digest[:8]}") == 1
    assert verify_noted(file, f"10:{digest[:8]}") == 1
    assert verify_noted(other, f"5:{digest[:8]}") == 1
    assert "record 5" in capsys.readouterr().out.splitlines()[-1]
    assert verify_noted(other, f"5:{digest[:8]}", earlier=(file,)) == 0


@pytest.mark.parametrize(
    "noted", ["5", "5:1234567", "0:12345678", "5:1234567g", "-1:12345678", "5:12345678:"]
)
def test_a_noted_head_needs_a_number_and_digits(tmp_path, noted):
    with pytest.raises(ConfigurationError, match="--noted"):
        verify_noted(make_log(tmp_path / "log", [1]), noted)


def run_writer(file, numbers):
    """Write records as an instrument does, from its start to its end."""
    writer = EventLogWriter(file)
    for number in numbers:
        writer.append(make_record(number))
    writer.close()
    return file


def verify(file, journal, *earlier):
    """Return the exit code of the verification with anchors."""
    return verify_events(file, Verification(anchors=journal, earlier=earlier), as_json=True)


def result_of(capsys):
    return json.loads(capsys.readouterr().out.splitlines()[-1])


class TestAnchorLines:
    """Tests of the lines of one writer."""

    def anchors(self, journal):
        with journal().open("rb") as lines:
            return find_anchors(lines)

    def test_the_start_and_the_end_are_anchored_with_the_complete_digest(self, tmp_path, journal):
        writer = EventLogWriter(tmp_path / "log")
        heads = []
        for number in range(2):
            writer.append(make_record(number))
            wait_until(lambda: writer.head.records and self.anchors(journal))
            wait_until(lambda number=number: writer.head.records == number + 1)
            heads.append(verify_log(tmp_path / "log").head)
        writer.close()
        anchors = self.anchors(journal)
        assert [(anchor.records, anchor.head) for anchor in anchors] == [(1, heads[0]), (2, heads[1])]
        assert all(anchor.at.endswith("Z") for anchor in anchors)

    def test_a_writer_that_ends_at_once_does_not_log_the_same_anchor_twice(self, tmp_path, journal):
        file = run_writer(tmp_path / "log", range(5))
        anchors = self.anchors(journal)
        assert anchors[-1].head == verify_log(file).head
        assert len({anchor.head for anchor in anchors}) == len(anchors)

    def test_the_first_anchor_of_a_start_contains_its_first_record(self, tmp_path, journal):
        file = run_writer(tmp_path / "log", range(5))
        run_writer(file, range(5, 6))
        assert [anchor.records for anchor in self.anchors(journal)][-2:] == [5, 6]

    def test_each_interval_is_anchored(self, tmp_path, journal, monkeypatch):
        monkeypatch.setattr("pneuforce.instrument.audit.writer.ANCHOR_INTERVAL_S", 0.2)
        writer = EventLogWriter(tmp_path / "log")
        writer.append(make_record(0))
        wait_until(lambda: len(self.anchors(journal)) >= 3)
        writer.close()

    def test_without_a_record_nothing_is_anchored(self, tmp_path, journal):
        run_writer(tmp_path / "log", [])
        assert self.anchors(journal) == []

    def test_a_replaced_file_is_anchored(self, tmp_path, journal):
        writer = EventLogWriter(tmp_path / "log")
        writer.append(make_record(0))
        wait_until(lambda: len(self.anchors(journal)) == 1)
        (tmp_path / "log").rename(tmp_path / "2026")
        wait_until(lambda: len(self.anchors(journal)) == 2)
        writer.close()
        assert {anchor.head for anchor in self.anchors(journal)[1:]} == {verify_log(tmp_path / "log").head}

    def test_the_anchor_lines_have_the_logger_whose_lines_are_never_displaced(self, tmp_path, caplog):
        caplog.set_level(logging.INFO, "pneuforce")
        run_writer(tmp_path / "log", range(2))
        assert {record.name for record in caplog.records if "head" in record.message} == {"pneuforce.state"}


class TestFindAnchors:
    """Tests of the search for anchors in the text of a journal."""

    def test_an_anchor_is_found_in_each_output_format_of_journalctl(self):
        anchor = Anchor(12, "ab" * 32, AT)
        line = format_anchor(anchor)
        for text in (
            line,
            f"09:00:01 {line}",
            f"Nov 22 15:31:00 host pneuforce[123]: 09:00:01 {line} (3 lines dropped before)",
            f"2027-01-31T08:00:00+0000 host pneuforce[123]: 09:00:01 {line}\r",
            json.dumps({"MESSAGE": f"09:00:01 {line}"}),
        ):
            assert find_anchors(io.BytesIO(f"x\n{text}\ny".encode())) == [anchor]

    @pytest.mark.parametrize(
        "text",
        [
            b"",
            b"\xff\xfe\x00",
            b"event log: 12 records, head 49a95ea7 at 2027-01-31T08:00:00Z",
            b"event log: -1 records, head " + b"ab" * 32,
            b"event log: 1e9 records, head " + b"ab" * 32 + b" at now",
            b"event log: " + b"9" * 5000 + b" records, head " + b"ab" * 32 + b" at 2027-01-31T08:00:00Z",
            b"x" * 1_000_000,
        ],
    )
    def test_other_text_contains_no_anchor(self, text):
        assert find_anchors(io.BytesIO(text)) == []


class TestManipulatedLogs:
    """Tests of logs whose digests are correct, so that only the anchors show the manipulation."""

    def test_an_honest_log_passes(self, tmp_path, journal, capsys):
        file = run_writer(tmp_path / "log", range(5))
        for first in range(5, 50, 5):
            run_writer(file, range(first, first + 5))
        assert verify(file, journal()) == 0
        assert result_of(capsys)["anchors"] >= 10

    def test_a_log_that_is_being_written_passes(self, tmp_path, journal):
        writer = EventLogWriter(tmp_path / "log")
        for number in range(3):
            writer.append(make_record(number))
        wait_until(lambda: "event log" in journal().read_text())
        assert verify(writer.path, journal()) == 0
        writer.close()

    @pytest.mark.parametrize("remaining", [1, 5, 9, 10, 19])
    def test_a_cut_end_is_found(self, tmp_path, journal, capsys, remaining):
        file = run_writer(tmp_path / "log", range(10))
        run_writer(file, range(10, 20))
        cut = make_log(tmp_path / "cut", range(remaining))
        assert verify_log(cut).records == remaining
        assert verify(cut, journal()) == 1
        assert result_of(capsys)["ok"] is False

    def test_a_rewritten_chain_with_correct_digests_is_found(self, tmp_path, journal):
        run_writer(tmp_path / "log", range(10))
        for changed in range(10):
            numbers = [number if number != changed else 99 for number in range(10)]
            forged = make_log(tmp_path / f"forged {changed}", numbers)
            assert verify_log(forged).records == 10
            assert verify(forged, journal()) == 1

    def test_an_older_copy_is_found_even_if_it_was_continued(self, tmp_path, journal, capsys):
        file = run_writer(tmp_path / "log", range(10))
        shutil.copy(file, tmp_path / "older")
        run_writer(file, range(10, 20))
        shutil.copy(tmp_path / "older", file)
        assert verify(file, journal()) == 1
        run_writer(file, range(30, 60))
        assert verify_log(file).records == 40
        assert verify(file, journal()) == 1
        assert "record 20 " in result_of(capsys)["message"]

    def test_an_older_copy_that_was_in_use_for_a_time_is_found(self, tmp_path, journal):
        """The complete log is in place again, but the journal shows that it was shorter for a time."""
        file = run_writer(tmp_path / "log", range(10))
        heads = [anchor_of(file)]
        run_writer(file, range(10, 20))
        anchors = [*heads, anchor_of(file), *heads]
        path = tmp_path / "journal"
        path.write_text("\n".join(map(format_anchor, anchors)))
        assert verify(file, path) == 1

    def test_the_time_of_the_first_missing_anchor_is_reported(self, tmp_path, journal, capsys):
        file = run_writer(tmp_path / "log", range(10))
        with journal().open("rb") as lines:
            first = find_anchors(lines)[0]
        run_writer(file, range(10, 20))
        with journal().open("rb") as lines:
            second = find_anchors(lines)[-1]
        cut = make_log(tmp_path / "cut", range(4))
        assert verify(cut, journal()) == 1
        why = result_of(capsys)["message"]
        assert why.startswith(f"at {first.at}, ")
        assert f"to {second.at}; later and in the log: none. " in why

    def test_a_broken_chain_is_found_with_anchors(self, tmp_path, journal):
        file = run_writer(tmp_path / "log", range(3))
        from pneuforce.instrument.audit.store import EventLogFile

        log = EventLogFile(file)
        log._last = log._last[0], bytes(32)
        log.append([b"{}"])
        log.close()
        assert verify(file, journal()) == 1


def anchor_of(file):
    chain = verify_log(file)
    return Anchor(chain.records, chain.head, AT)


class TestRestoredBackup:
    """Tests of a log that was restored from an older backup and continued by the instrument."""

    @pytest.fixture
    def restored(self, tmp_path):
        """Return the restored log, the log with the lost records, and the journals of three times."""
        file, newer = tmp_path / "log", tmp_path / "newer"
        backup = make_log(tmp_path / "backup", range(10))
        anchors = [anchor_of(backup)]
        for end in (12, 15):
            newer.unlink(missing_ok=True)
            anchors.append(anchor_of(make_log(newer, range(end))))
        shutil.copy(backup, file)
        for number in (30, 31):
            run_writer(file, [number])
            anchors.append(anchor_of(file))
        anchors = [anchor._replace(at=f"2027-01-31T0{n}:00:00.000000Z") for n, anchor in enumerate(anchors)]
        journals = []
        for name, chosen in (("all", anchors), ("backup", anchors[:1]), ("since", anchors[3:])):
            journals.append(tmp_path / f"{name}.txt")
            journals[-1].write_text("\n".join(map(format_anchor, chosen)))
        return file, newer, journals

    def test_the_lost_anchors_are_named_and_those_since_the_restore_are_counted(self, restored, capsys):
        file, _, (journal, *_) = restored
        assert verify(file, journal) == 1
        assert (
            "Not in the log: 2 anchors from 2027-01-31T01:00:00.000000Z to 2027-01-31T02:00:00.000000Z; "
            "later and in the log: 2 anchors from 2027-01-31T03"
        ) in result_of(capsys)["message"]

    def test_the_log_with_the_lost_records_explains_them(self, restored):
        file, newer, (journal, *_) = restored
        assert verify(file, journal, newer) == 0

    def test_the_anchors_before_the_backup_and_since_the_restore_are_in_the_log(self, restored):
        file, _, (_, *journals) = restored
        assert [verify(file, journal) for journal in journals] == [0, 0]


class TestEarlierLogs:
    """Tests of logs that were moved away, so that a new log begins."""

    def moved(self, tmp_path):
        """Return two earlier logs and the present log. The second log was moved while it was written."""
        files = [tmp_path / name for name in ("2025", "2026", "log")]
        run_writer(files[2], range(10)).rename(files[0])
        writer = EventLogWriter(files[2])
        writer.append(make_record(0))
        wait_until(lambda: verify_log(files[2]).records == 1)
        files[2].rename(files[1])
        wait_until(files[2].exists)
        writer.close()
        return files

    def test_an_anchor_may_be_in_an_earlier_log(self, tmp_path, journal):
        first, second, present = self.moved(tmp_path)
        assert verify(present, journal(), first, second) == 0

    @pytest.mark.parametrize("missing", [0, 1])
    def test_without_an_earlier_log_its_anchors_are_missing(self, tmp_path, journal, missing):
        *earlier, present = self.moved(tmp_path)
        del earlier[missing]
        assert verify(present, journal(), *earlier) == 1

    def test_a_replaced_log_whose_records_are_lost_is_found(self, tmp_path, journal):
        writer = EventLogWriter(tmp_path / "log")
        writer.append(make_record(0))
        wait_until(lambda: "event log" in journal().read_text())
        for file in tmp_path.glob("log*"):
            file.unlink()
        wait_until((tmp_path / "log").exists)
        writer.close()
        assert verify_log(tmp_path / "log").records == 1  # file_changed
        assert verify(tmp_path / "log", journal()) == 1

    def test_the_order_of_the_files_is_checked(self, tmp_path, journal):
        first, second, present = self.moved(tmp_path)
        assert verify(present, journal(), second, first) == 1

    def test_a_copy_of_the_log_as_an_earlier_log_changes_nothing(self, tmp_path, journal):
        file = run_writer(tmp_path / "log", range(10))
        shutil.copy(file, tmp_path / "copy")
        run_writer(file, range(10, 20))
        assert verify(file, journal(), tmp_path / "copy") == 0


def test_anchors_may_be_in_two_files_in_any_order_of_their_prefixes():
    a, b = Anchor(1, "a" * 64, AT), Anchor(2, "b" * 64, AT)
    logs = [{1: a.head}, {1: a.head, 2: b.head}]
    check_anchors([a, b, b], logs)
    with pytest.raises(BrokenChainError):
        check_anchors([a, b, a], [logs[1]])
    with pytest.raises(BrokenChainError):
        check_anchors([Anchor(1, b.head, AT)], logs)


def test_a_journal_without_anchors_is_an_error(tmp_path):
    file = make_log(tmp_path / "log", range(3))
    (tmp_path / "journal").write_text("nothing here\n")
    for journal in ("journal", "missing", ""):
        with pytest.raises(ConfigurationError):
            verify(file, tmp_path / journal)


def test_the_anchors_can_be_read_from_stdin(tmp_path, journal):
    file, cut = run_writer(tmp_path / "log", range(3)), make_log(tmp_path / "cut", range(2))
    for target, code in ((file, 0), (cut, 1)):
        done = subprocess.run(
            [sys.executable, "-m", "pneuforce", "log", "verify", "--file", target, "--anchors", "-"],
            input=journal().read_bytes(),
            capture_output=True,
            check=False,
            timeout=60,
        )
        assert done.returncode == code, done.stderr


def test_the_command_reads_anchors_and_earlier_logs(tmp_path, journal):
    file = run_writer(tmp_path / "log", range(3))
    file.rename(tmp_path / "2026")
    run_writer(file, range(3, 6))
    words = ["log", "verify", "--file", file, "--anchors", journal()]
    assert pneuforce(*words).returncode == 1
    done = pneuforce(*words, "--earlier", tmp_path / "2026", "--json")
    assert done.returncode == 0
    assert json.loads(done.stdout)["anchors"] >= 2
    done = pneuforce("log", "verify", "--file", file, "--earlier", tmp_path / "2026")
    assert done.returncode == 2
