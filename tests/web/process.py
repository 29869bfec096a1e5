"""Web process for tests, and HTTP requests to it."""

import contextlib
import http.client
import json
import subprocess
import sys

from tests.web.serving import cookies_of, read_events
from tests.web.users import OPERATOR, PASSWORD


@contextlib.contextmanager
def web_process(**options):
    """Start a web process. Yield the process and its first line of output."""
    process = subprocess.Popen(
        [sys.executable, "-P", "-m", "pneuforce.web"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    options = {"socket": "/nowhere", "host": "127.0.0.1", "port": 0, "allow": [], **options}
    process.stdin.write(json.dumps(options) + "\n")
    process.stdin.flush()
    try:
        yield process, json.loads(process.stdout.readline())
    finally:
        process.kill()
        process.wait()
        for stream in (process.stdin, process.stdout, process.stderr):
            stream.close()


@contextlib.contextmanager
def crowd(port, behaviours, count, addresses):
    """Run clients in another process; see `crowd.py`."""
    command = [sys.executable, "-m", "tests.web.crowd", str(port), behaviours, str(count), *addresses]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as process:
        try:
            process.stdout.readline()
            yield
        finally:
            process.kill()


@contextlib.contextmanager
def event_stream(port):
    """Open /api/live. Yield an iterator of (event type, data)."""
    with contextlib.closing(http.client.HTTPConnection("127.0.0.1", port, timeout=60)) as connection:
        connection.request("GET", "/api/live")
        yield read_events(connection.getresponse())


def cookies(port, name=OPERATOR, password=PASSWORD):
    """Log in. Return the headers with the cookies of the browser."""
    with contextlib.closing(http.client.HTTPConnection("127.0.0.1", port, timeout=60)) as connection:
        connection.request("POST", "/api/login", json.dumps({"name": name, "password": password}))
        response = connection.getresponse()
        assert response.status == 200
        return cookies_of(response.headers)


def request(port, method, path, body=None, headers=()):
    """Send a request. Return the HTTP status and the JSON body."""
    with contextlib.closing(http.client.HTTPConnection("127.0.0.1", port, timeout=60)) as connection:
        connection.request(method, path, None if body is None else json.dumps(body), dict(headers))
        response = connection.getresponse()
        return response.status, json.loads(response.read())
