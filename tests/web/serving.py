"""A page that serves real browsers' requests, and an instrument at its local socket that tests speak for."""

import asyncio
import contextlib
import http.client
import json
import socket
import threading
import time

from instrument.tape.entry import Decoder, Kind, encode, told
from page.__main__ import Options, parts_of, serve, server_of
from page.door import door
from tests.page.entries import snapshot
from tests.system.waiting import wait_for

TOKEN = "correct-horse-battery"


class Station:
    """The instrument's end of the local socket: what it says, and how it answers."""

    def __init__(self, path):
        self.path, self.asked, self.seen_s = path, [], []
        self.refusal, self.answers = "none", True
        self.guests, self.wanted = [], []
        self.open()

    def open(self):
        self._listener = socket.socket(socket.AF_UNIX)
        self._listener.bind(str(self.path))
        self._listener.listen()
        threading.Thread(target=self._accept, args=(self._listener,), daemon=True).start()

    def _accept(self, listener):
        with contextlib.suppress(OSError):
            while True:
                guest, _ = listener.accept()
                self.guests.append(guest)
                threading.Thread(target=self._hear, args=(guest,), daemon=True).start()

    def _hear(self, guest):
        decoder = Decoder()
        with contextlib.suppress(OSError):
            while data := guest.recv(65536):
                for entry in decoder.feed(data):
                    self._answer(guest, entry)

    def _answer(self, guest, entry):
        if entry.kind is Kind.WANT:
            self.wanted.append(entry.facts)
        elif self.answers:
            self.asked.append(entry.facts["values"])
            self.seen_s.append(entry.facts["seen_s"])
            facts = {"id": entry.facts["id"], "refusal": self.refusal, "why": ""}
            guest.sendall(encode(told(Kind.ANSWER, time.monotonic(), facts)))

    def say(self, *entries):
        self.guests[-1].sendall(b"".join(map(encode, entries)))

    def close(self):
        self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        for guest in self.guests:
            with contextlib.suppress(OSError):  # it has gone by itself
                guest.shutdown(socket.SHUT_RDWR)
        self.path.unlink(missing_ok=True)


class Site:
    """A page in a thread of its own."""

    def __init__(self, socket_path, **options):
        chosen = {"host": "127.0.0.1", "port": 0, "allow": [], "token": TOKEN, **options}
        self.parts = parts_of(Options(socket=str(socket_path), **chosen))
        bound = door(chosen["host"], chosen["port"])
        self.port = bound.getsockname()[1]
        self._server = server_of(self.parts)
        self._thread = threading.Thread(target=self._run, args=(bound,), daemon=True)
        self._thread.start()

    def _run(self, bound):
        asyncio.run(serve(self.parts, self._server, bound))

    def end(self):
        self._server.end()
        self._thread.join(10)
        assert not self._thread.is_alive()

    def connect(self, timeout_s=10):
        return http.client.HTTPConnection("127.0.0.1", self.port, timeout=timeout_s)

    def ask(self, method, path, body=None, **headers):
        """Status, headers, and what the answer holds."""
        with contextlib.closing(self.connect()) as connection:
            connection.request(method, path, body, headers)
            response = connection.getresponse()
            data = response.read()
        is_json = response.headers["content-type"] == "application/json"
        return response.status, response.headers, json.loads(data) if is_json and data else data

    def get(self, path, **headers):
        return self.ask("GET", path, **headers)

    def post(self, path, facts, **headers):
        body = facts if isinstance(facts, str | bytes) else json.dumps(facts)
        return self.ask("POST", path, body, **headers)

    def write(self, values, token=TOKEN, seen_s=1.0, **headers):
        return self.post("/api/write", {"token": token, "values": values, "seen_s": seen_s}, **headers)

    @contextlib.contextmanager
    def live(self):
        """The stream, as pairs of an event's name and its data."""
        with contextlib.closing(self.connect()) as connection:
            connection.request("GET", "/api/live")
            response = connection.getresponse()
            assert response.status == 200
            assert response.headers["content-type"].startswith("text/event-stream")
            yield events(response)


def events(lines):
    name = ""
    for line in lines:
        key, _, value = line.decode().rstrip("\n").partition(": ")
        if key == "event":
            name = value
        elif key == "data":
            yield name, json.loads(value)


def until(stream, name, wanted=lambda data: True):
    """The next event of that name for which `wanted` holds."""
    return next(data for event, data in stream if event == name and wanted(data))


def say_again(station, site, facts):
    """Let the instrument say this, and go on saying it, until the page has it."""

    def said():
        station.say(snapshot(time.monotonic(), **facts))
        return site.parts.view.snapshot

    wait_for(said, lambda known: known is not None)
