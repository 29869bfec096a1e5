"""Tests of the recordings that an operator starts on the web page."""

import contextlib
import signal
import sqlite3
from pathlib import Path
from urllib.parse import quote, urlsplit

import pytest

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.recording.opening import open_recording
from pneuforce.instrument.recording.schema import EndReason
from pneuforce.web.page_recorder import NO_END
from tests.instrument.recording.recording_files import read_contents
from tests.system.waiting import wait_for
from tests.web.browser import NEEDS_CHROMIUM, NEEDS_PLAYWRIGHT
from tests.web.process import cookies, request, web_process
from tests.web.serving import Site
from tests.web.users import OPERATOR, VIEWER, users_file

pytestmark = [NEEDS_CHROMIUM, NEEDS_PLAYWRIGHT]


@contextlib.contextmanager
def site_of(live, folder, **options):
    """Serve a web page of its own for the running instrument, in this process."""
    file = live.tables["web"]["users_file"]
    site = Site(live.tables["local"]["socket"], recordings=str(folder), users_file=file, **options)
    try:
        wait_for(lambda: site.services.feed.header, bool)
        yield site
    finally:
        site.stop()


def state(site):
    """Return the state of the recording as a new browser receives it."""
    return site.services.recorder.message().data


def act(site, action):
    status, _, answer = site.post(f"/api/recording/{action}", {}, **site.cookies())
    return status, answer


def download(site, name, user=OPERATOR):
    return site.get(f"/api/recordings/{quote(name, safe='')}", **(site.cookies(user) if user else {}))


def samples_in(file):
    try:
        return len(read_contents(file).samples)
    except ConfigurationError:  # no header yet
        return 0


def recording_in(folder):
    """Return the only recording of a folder, as soon as it contains samples."""
    (file,) = wait_for(lambda: list(Path(folder).glob("*.recording")), bool)
    wait_for(lambda: samples_in(file), bool)
    return file


@pytest.mark.parametrize("action", ["start", "stop"])
def test_only_an_operator_records_and_gets_recordings(tmp_path, action):
    site = Site(tmp_path / "no.sock", recordings=str(tmp_path / "made"))
    path = f"/api/recording/{action}"
    assert site.post(path, {})[0] == 401
    assert site.post(path, {}, **site.cookies(VIEWER))[0] == 403
    assert site.post(path, {}, Origin="http://evil.example", **site.cookies())[0] == 403
    assert [download(site, "a", user)[0] for user in (None, VIEWER, OPERATOR)] == [401, 403, 404]
    site.stop()
    assert not (tmp_path / "made").exists()


def test_a_recording_is_complete_after_its_stop_and_can_be_downloaded(live, tmp_path):
    with site_of(live, tmp_path / "made") as site:
        assert act(site, "start") == (200, {})
        assert act(site, "start")[0] == 409
        file = recording_in(tmp_path / "made")
        wait_for(lambda: state(site)["active"]["bytes"], bool)
        assert state(site)["active"]["file"] == file.name
        assert download(site, file.name)[0] == 404
        assert act(site, "stop") == (200, {})
        assert act(site, "stop")[0] == 409
        assert state(site)["active"] is None
        assert state(site)["last"]["complete"] is True
        assert state(site)["finished"] == [{"file": file.name, "bytes": file.stat().st_size}]
        assert read_contents(file).ending.how == EndReason.STOPPED
        assert [download(site, name)[0] for name in ("../a", "/etc/passwd", "..", "a")] == [404] * 4
        status, headers, content = download(site, file.name)
        assert (status, content) == (200, file.read_bytes())
        assert file.name in headers["content-disposition"]


def test_a_recording_that_is_read_when_it_ends_is_listed_and_can_be_downloaded(live, tmp_path):
    with site_of(live, tmp_path / "made") as site:
        assert act(site, "start") == (200, {})
        file = recording_in(tmp_path / "made")
        with open_recording(file):
            assert act(site, "stop") == (200, {})
        assert Path(f"{file}-wal").exists()
        assert state(site)["finished"] == [{"file": file.name, "bytes": file.stat().st_size}]
        assert download(site, file.name)[:3:2] == (200, file.read_bytes())
    with site_of(live, tmp_path / "made") as site:  # the next web process
        last = wait_for(lambda: state(site)["last"], bool)
    assert (last["complete"], last["bytes"]) == (True, file.stat().st_size)


def test_a_recording_that_cannot_start_or_continue_says_why(live, tmp_path):
    (tmp_path / "file").write_text("not a folder")
    with site_of(live, tmp_path / "file") as site:
        assert "cannot be created" in act(site, "start")[1]["text"]
    with site_of(live, "") as site:
        assert act(site, "start")[0] == 409
        assert state(site)["enabled"] is False
    with site_of(live, tmp_path / "full", recording_min_free_mb=1e9) as site:
        assert "must stay free" in act(site, "start")[1]["text"]
        assert state(site)["last"]["complete"] is False
    with site_of(live, tmp_path / "gone") as site:
        assert act(site, "start")[0] == 200
        recording_in(tmp_path / "gone").unlink()
        wait_for(lambda: state(site)["last"], bool)
        assert EndReason.UNWRITABLE in state(site)["last"]["text"]


def test_a_recording_ends_completely_when_the_web_process_is_killed(live, tmp_path):
    web = {"recordings": str(tmp_path), "users_file": users_file(tmp_path)}
    options = {"socket": live.tables["local"]["socket"], **web}
    with web_process(**options) as (process, ready):
        login = cookies(ready["port"])
        assert request(ready["port"], "POST", "/api/recording/start", {}, login)[0] == 200
        file = recording_in(tmp_path)
        process.kill()
        wait_for(lambda: read_contents(file).ending, bool)
    assert read_contents(file).ending.how == EndReason.STOPPED
    with site_of(live, tmp_path) as site:  # the next web process
        last = wait_for(lambda: state(site)["last"], bool)
    assert (last["file"], last["text"]) == (file.name, EndReason.STOPPED)
    assert (last["complete"], last["bytes"]) == (True, file.stat().st_size)
    assert last["seconds"] >= 0


def test_a_recording_whose_recorder_was_killed_says_so_after_a_restart(live, tmp_path):
    with site_of(live, tmp_path) as site:
        assert act(site, "start") == (200, {})
        file = recording_in(tmp_path)
        assert act(site, "stop") == (200, {})
    with contextlib.closing(sqlite3.connect(file)) as db:
        db.execute("DELETE FROM ending")
        db.commit()
    with site_of(live, tmp_path) as site:
        last = wait_for(lambda: state(site)["last"], bool)
    assert (last["file"], last["text"], last["complete"]) == (file.name, NO_END, False)


def test_an_operator_records_with_the_page(page, live):
    page("click", on="#record-button")
    page.wait_for_text("#record-active", "MB")
    assert page.text("#record-button") == "Stop recording"
    page("reload")
    page.wait_for_text("#record-active", "MB")
    file = recording_in(live.tables["web"]["recordings"])
    page("click", on="#record-button")
    page.wait_for_text("#record-last", "Ended")
    page.wait_for_text("#recordings", file.stem)
    assert page("download", on="#recordings button")["name"] == file.name
    page("click", on="#log-out-button")
    page.wait("document.querySelector('#recordings button').ariaDisabled === 'true'")
    assert "Log in" in page.text("#record-reason")
    live.log_in()
    page.wait("document.querySelector('#recordings button')?.ariaDisabled === 'false'")
    file.unlink()


def test_a_recording_ends_completely_with_the_instrument(live):
    port = urlsplit(live.url).port
    assert request(port, "POST", "/api/recording/start", {}, cookies(port))[0] == 200
    file = recording_in(live.tables["web"]["recordings"])
    live.stack.host.send(signal.SIGTERM)
    wait_for(lambda: live.stack.host.running, lambda running: not running)
    ending = read_contents(file).ending
    assert (ending.how, ending.why) == (EndReason.END, "stop requested")
    live.restart()
    live.log_in()
