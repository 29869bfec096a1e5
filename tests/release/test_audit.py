"""Tests of the search for known vulnerabilities: connection, exceptions, and the result for each library."""

import datetime
import json
import os
import subprocess
import sys
import threading
from http.server import BaseHTTPRequestHandler, HTTPServer

import pytest

from release.audit import FAILED, PASSED, accepted, judge
from release.vulnerability_service import failure
from tests.source_tree import ROOT

TODAY = datetime.date(2026, 11, 23)
TOOLS = ROOT / "build/release-tools/bin/python"
VULNERABLE = {
    "name": "wrapt",
    "version": "1.17.3",
    "vulns": [{"id": "PYSEC-1", "aliases": ["CVE-1"], "fix_versions": []}],
}
CHECKED = {"name": "rich", "version": "15.0.0", "vulns": []}
SKIPPED = {"name": "numpy", "skip_reason": "not found"}
EXCEPTION = '[[exception]]\nid = "CVE-1"\nreason = "unused"\nuntil = 2026-11-23\n'


def test_without_a_connection_the_audit_says_so_and_succeeds():
    """A proxy that refuses connections makes the service unreachable."""
    environment = {**os.environ, "https_proxy": "http://127.0.0.1:9", "no_proxy": ""}
    command = [sys.executable, "-m", "release.vulnerability_service"]
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (1, "")
    assert "not checked: no connection" in done.stdout


class Service(BaseHTTPRequestHandler):
    """Vulnerability service that knows one vulnerability of wrapt, and answers with its status code."""

    status = 200

    def do_POST(self):
        query = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        vulnerability = {"id": "PYSEC-1", "aliases": ["CVE-1"], "summary": "", "affected": []}
        found = [vulnerability] if query["package"]["name"] == "wrapt" else []
        self.send_response(self.status)
        self.end_headers()
        self.wfile.write(json.dumps({"vulns": found}).encode())

    def log_message(self, *_):
        """Write nothing."""


@pytest.fixture
def service():
    server = HTTPServer(("127.0.0.1", 0), Service)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}/query"
    server.shutdown()
    thread.join()
    server.server_close()


def test_a_service_is_reachable_only_if_it_answers_the_query(service, monkeypatch):
    assert failure(service) == ""
    monkeypatch.setattr(Service, "status", 503)
    assert "503" in failure(service)


def test_a_vulnerability_fails_unless_an_exception_accepts_it():
    assert judge({"dependencies": [VULNERABLE, CHECKED]}, set()).exit_code == FAILED
    result = judge({"dependencies": [VULNERABLE, CHECKED]}, accepted(EXCEPTION, TODAY))
    assert result.exit_code == PASSED
    assert result.lines[0].startswith("accepted")


def test_a_library_that_was_not_checked_is_named():
    result = judge({"dependencies": [SKIPPED, CHECKED]}, set())
    assert result == (["not checked: numpy: not found", "1 of 2 libraries checked"], PASSED)


def test_an_exception_needs_a_reason_and_ends():
    with pytest.raises(ValueError, match="no reason and no until"):
        accepted('[[exception]]\nid = "CVE-1"\n', TODAY)
    with pytest.raises(ValueError, match="valid until 2026-11-23"):
        accepted(EXCEPTION, TODAY + datetime.timedelta(days=1))


def run_with_tools(*options, **environment):
    command = [TOOLS, "-m", "release.audit", *options]
    done = subprocess.run(
        command, cwd=ROOT, env={**os.environ, **environment}, capture_output=True, text=True, check=False
    )
    return done.returncode, done.stdout


@pytest.mark.slow
def test_pip_audit_reports_the_vulnerable_library(service):
    exit_code, output = run_with_tools("--osv-url", service)
    assert exit_code == FAILED
    assert "vulnerable: wrapt 1.17.3: PYSEC-1" in output


@pytest.mark.slow
def test_pip_audit_without_a_connection_is_not_a_pass_without_words(monkeypatch):
    exit_code, output = run_with_tools("--osv-url", "http://127.0.0.1:9/query", no_proxy="*")
    assert exit_code == PASSED
    assert "not checked: no connection" in output
