"""Tests of the comparison of an event log with the heads that a witness has observed."""

import http.server
import json
import threading

import pytest

from pneuforce.instrument.audit.anchor import NotedDigest, collect_heads
from pneuforce.instrument.audit.reading import open_event_log
from pneuforce.instrument.audit.witness import MAX_GAP_S, HeadSample, compare, gaps_in, observed_heads
from tests.command_runner import pneuforce
from tests.instrument.audit.event_log_files import make_log

START_S, SCRAPE_S = 1.8e9, 15.0


def heads_of(file):
    """Return the digest of each record of a log by its number."""
    heads = {}
    with open_event_log(file) as rows:
        numbers = (NotedDigest(number, "") for number in range(100))
        list(collect_heads(rows, numbers, heads))
    return heads


@pytest.fixture
def heads(tmp_path):
    return heads_of(make_log(tmp_path / "log", range(10)))


def seen(heads, *numbers, start_s=START_S):
    """Return the observations of a log that has these numbers of records, one after another."""
    return [HeadSample(start_s + SCRAPE_S * n, number, heads[number]) for n, number in enumerate(numbers)]


def report(samples, *logs):
    return compare(observed_heads(samples), gaps_in(samples), logs, max(logs[-1]))


def test_a_log_agrees_with_all_heads_that_were_observed(heads):
    found = report(seen(heads, 3, 3, 5, 10), heads)
    assert (found.missing, found.contradicts) == ((), ())
    assert "3 observed heads" in found.agrees
    assert "record 10" in found.agrees


def test_records_after_the_last_observation_are_reported_but_are_no_contradiction(heads):
    found = report(seen(heads, 3, 7), heads)
    assert found.contradicts == ()
    assert len(found.missing) == 1
    assert found.missing[0].startswith("3 records")


def test_the_longest_time_without_an_observation_is_reported(heads):
    early, later = seen(heads, 3, 4), seen(heads, 10, start_s=START_S + 10 * MAX_GAP_S)
    (missing,) = report(early + later, heads).missing
    assert missing.startswith("1 time ")
    assert gaps_in(early + later) == [(START_S + SCRAPE_S, START_S + 10 * MAX_GAP_S)]
    assert gaps_in(early) == []


def test_a_cut_log_is_found(heads):
    cut = {number: head for number, head in heads.items() if number <= 6}
    found = report(seen(heads, 3, 8, 10), cut)
    assert len(found.contradicts) == 2
    assert "only 6 records" in found.contradicts[0]
    assert "record 3" in found.agrees


def test_a_rewritten_log_is_found_even_if_it_has_grown(heads, tmp_path):
    other = heads_of(make_log(tmp_path / "other", [*range(5), 99, *range(6, 20)]))
    found = report(seen(heads, 3, 8, 10), other)
    assert [text.split("record ")[1].split()[0] for text in found.contradicts] == ["8", "10"]
    assert "another digest" in found.contradicts[0]


def test_an_older_copy_that_was_in_use_for_a_time_is_found(heads):
    found = report(seen(heads, 8, 3, 3, 9), heads)
    (contradiction,) = found.contradicts
    assert "record 3" in contradiction
    assert "8 records" in contradiction


def test_a_log_that_was_moved_away_is_no_contradiction(heads, tmp_path):
    new = heads_of(make_log(tmp_path / "new", range(50, 54)))
    samples = seen(heads, 8, 10) + seen(new, 1, 4, start_s=START_S + 60)
    assert report(samples, heads, new).contradicts == ()
    assert len(report(samples, new).contradicts) == 2
    (missing,) = report(seen(heads, 8, 10), heads, new).missing
    assert missing.startswith("4 records")


def test_if_nothing_agrees_the_report_says_so(heads):
    found = report(seen({7: "00" * 32}, 7), heads)
    assert "no observed head" in found.agrees
    assert len(found.contradicts) == 1


ANSWERS = [
    b"<html>hello</html>",
    b'{"status": "success"}',
    b'{"data": {"result": [1]}}',
    json.dumps({"data": {"result": [{"metric": {}, "values": [["x", "1"]]}]}}).encode(),
    json.dumps({"data": {"result": [{"metric": {"head": "no digest"}, "values": [[1, "1"]]}]}}).encode(),
]


@pytest.fixture
def wrong_server():
    """Return a function that starts a web server with one answer to all requests. It returns the address."""
    servers = []

    def start(answer, status=200):
        class Handler(http.server.BaseHTTPRequestHandler):
            def do_GET(self):
                self.send_response(status)
                self.end_headers()
                self.wfile.write(answer)

            def log_message(self, *words):
                pass

        servers.append(http.server.HTTPServer(("127.0.0.1", 0), Handler))
        threading.Thread(target=servers[-1].serve_forever, daemon=True).start()
        return f"http://127.0.0.1:{servers[-1].server_port}"

    yield start
    for server in servers:
        server.shutdown()
        server.server_close()


def verify(tmp_path, *options):
    """Return the exit code and the JSON message of `log verify` with these options."""
    file = make_log(tmp_path / "log", range(3))
    done = pneuforce("log", "verify", "--file", file, "--json", *options)
    assert done.stderr == ""
    return done.returncode, json.loads(done.stdout)["message"]


@pytest.mark.parametrize("answer", ANSWERS)
def test_another_server_than_prometheus_is_reported_in_one_sentence(wrong_server, tmp_path, answer):
    address = wrong_server(answer)
    code, message = verify(tmp_path, "--witness", address)
    assert code == 2
    assert address in message


def test_a_query_that_is_rejected_is_reported(wrong_server, tmp_path):
    code, message = verify(tmp_path, "--witness", wrong_server(b"no", 403))
    assert (code, "403" in message) == (2, True)


@pytest.mark.parametrize(
    ("options", "code"),
    [
        (("--witness", "http://127.0.0.1:1"), 69),
        (("--witness", "file:///etc/passwd"), 2),
        (("--witness", "prometheus"), 2),
        (("--witness", "http://[::1"), 2),
        (("--witness", "http://127.0.0.1:x"), 2),
        (("--instance", "a:8080"), 2),
    ],
)
def test_wrong_options_and_a_missing_server_have_their_exit_codes(tmp_path, options, code):
    assert verify(tmp_path, *options)[0] == code
