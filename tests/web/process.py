"""The page as a process, and what is asked of it."""

import contextlib
import http.client
import json
import subprocess
import sys

from tests.page.serving import TOKEN, events


@contextlib.contextmanager
def page(**options):
    process = subprocess.Popen(
        [sys.executable, "-P", "-m", "page"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    told = {"socket": "/nowhere", "host": "127.0.0.1", "port": 0, "allow": [], "token": TOKEN, **options}
    process.stdin.write(json.dumps(told) + "\n")
    process.stdin.flush()
    try:
        yield process, json.loads(process.stdout.readline())
    finally:
        process.kill()
        process.wait()
        for stream in (process.stdin, process.stdout, process.stderr):
            stream.close()


@contextlib.contextmanager
def browser(port):
    with contextlib.closing(http.client.HTTPConnection("127.0.0.1", port, timeout=20)) as connection:
        connection.request("GET", "/api/live")
        yield events(connection.getresponse())


def ask(port, method, path, facts=None):
    with contextlib.closing(http.client.HTTPConnection("127.0.0.1", port, timeout=20)) as connection:
        connection.request(method, path, None if facts is None else json.dumps(facts))
        response = connection.getresponse()
        return response.status, json.loads(response.read())
