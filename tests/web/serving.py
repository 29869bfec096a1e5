"""Web server in a thread, and a fake instrument at its local socket."""

import asyncio
import contextlib
import http.client
import json
import socket
import threading
import time
from http.cookies import SimpleCookie
from pathlib import Path

from pneuforce.instrument.stream.entry import EntryDecoder, EntryKind, encode, json_entry
from pneuforce.web.__main__ import WebProcessOptions, create_server, create_services, serve
from pneuforce.web.server.listener import open_listener
from tests.system.waiting import wait_for
from tests.web.entries import snapshot
from tests.web.users import OPERATOR, PASSWORD, users_file


class FakeInstrument:
    """Instrument side of the local socket, which sends given entries, and records and answers requests."""

    def __init__(self, path):
        self.path, self.requests, self.seen_s = path, [], []
        self.addresses, self.logins = [], []
        self.reject_reason, self.answers, self.delay_s = "none", True, 0.0
        self.clients, self.subscriptions = [], []
        self.open()

    def open(self):
        self._listener = socket.socket(socket.AF_UNIX)
        self._listener.bind(str(self.path))
        self._listener.listen()
        threading.Thread(target=self._accept, args=(self._listener,), daemon=True).start()

    def _accept(self, listener):
        with contextlib.suppress(OSError):
            while True:
                client, _ = listener.accept()
                self.clients.append(client)
                threading.Thread(target=self._receive, args=(client,), daemon=True).start()

    def _receive(self, client):
        decoder = EntryDecoder()
        with contextlib.suppress(OSError):
            while data := client.recv(65536):
                for entry in decoder.feed(data):
                    self._process(client, entry)

    def _process(self, client, entry):
        if entry.kind is EntryKind.SUBSCRIBE:
            self.subscriptions.append(entry.json_body)
        elif entry.kind is EntryKind.LOGIN:
            self.logins.append(entry.json_body)
        elif self.answers:
            self.addresses.append(entry.json_body["address"])
            self.requests.append(entry.json_body["values"])
            self.seen_s.append(entry.json_body.get("seen_s"))
            time.sleep(self.delay_s)
            answer = {"id": entry.json_body["id"], "reject_reason": self.reject_reason, "why": ""}
            client.sendall(encode(json_entry(EntryKind.ANSWER, time.monotonic(), answer)))

    def send(self, *entries):
        self.clients[-1].sendall(b"".join(map(encode, entries)))

    def close(self):
        self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        for client in self.clients:
            with contextlib.suppress(OSError):  # already disconnected
                client.shutdown(socket.SHUT_RDWR)
        self.path.unlink(missing_ok=True)


class Site:
    """Web server in a thread, with methods that send requests. The test users may log in."""

    def __init__(self, socket_path, **options):
        options = {"host": "127.0.0.1", "port": 0, "allow": [], **options}
        if "users_file" not in options:
            options["users_file"] = users_file(Path(socket_path).parent)
        self._cookies = {}
        self.services = create_services(WebProcessOptions(socket=str(socket_path), **options))
        listener = open_listener(options["host"], options["port"])
        self.port = listener.getsockname()[1]
        self._server = create_server(self.services)
        self._thread = threading.Thread(target=self._run, args=(listener,), daemon=True)
        self._thread.start()

    def _run(self, listener):
        asyncio.run(serve(self.services, self._server, listener))

    def stop(self):
        self._server.stop()
        self._thread.join(10)
        assert not self._thread.is_alive()

    def connect(self, timeout_s=60, address="127.0.0.1"):
        """Return a connection from an address of this machine."""
        return http.client.HTTPConnection(
            "127.0.0.1", self.port, timeout=timeout_s, source_address=(address, 0)
        )

    def request(self, method, path, body=None, **headers):
        """Send a request. Return status, headers, and the body (parsed if it is JSON)."""
        with contextlib.closing(self.connect()) as connection:
            connection.request(method, path, body, headers)
            response = connection.getresponse()
            data = response.read()
        is_json = response.headers["content-type"] == "application/json"
        return response.status, response.headers, json.loads(data) if is_json and data else data

    def get(self, path, **headers):
        return self.request("GET", path, **headers)

    def post(self, path, body, **headers):
        body = body if isinstance(body, str | bytes) else json.dumps(body)
        return self.request("POST", path, body, **headers)

    def log_in(self, name=OPERATOR, password=PASSWORD, **headers):
        """Log in. Return the HTTP status, and the headers with the cookies of the browser."""
        body = {"name": name, "password": password}
        status, received, _ = self.post("/api/login", body, **headers)
        return status, cookies_of(received)

    def cookies(self, name=OPERATOR):
        """Return the headers with the cookies of a browser in which a user has logged in."""
        if name not in self._cookies:
            status, self._cookies[name] = self.log_in(name)
            assert status == 200
        return self._cookies[name]

    def write(self, values, user=OPERATOR, seen_s=1.0, **headers):
        """Send a write request of a user, or without a login if the user is None."""
        headers = (self.cookies(user) if user else {}) | headers
        return self.post("/api/write", {"values": values, "seen_s": seen_s}, **headers)

    @contextlib.contextmanager
    def event_stream(self, address="127.0.0.1", **headers):
        """Open /api/live from an address of this machine. Yield an iterator of (event type, data)."""
        with contextlib.closing(self.connect(address=address)) as connection:
            connection.request("GET", "/api/live", headers=headers)
            response = connection.getresponse()
            assert response.status == 200
            assert response.headers["content-type"].startswith("text/event-stream")
            yield read_events(response)


def cookies_of(headers):
    """Return the header with all cookies that a response sets."""
    jar = SimpleCookie()
    for line in headers.get_all("set-cookie") or ():
        jar.load(line)
    return {"Cookie": "; ".join(f"{name}={morsel.value}" for name, morsel in jar.items())}


def read_events(lines):
    """Yield (event type, data) for the lines of an event stream."""
    name = ""
    for line in lines:
        key, _, value = line.decode().rstrip("\n").partition(": ")
        if key == "event":
            name = value
        elif key == "data":
            yield name, json.loads(value)


def until(stream, name, condition=lambda data: True):
    """Return the data of the next event of this type for which `condition(data)` is true."""
    return next(data for event, data in stream if event == name and condition(data))


def send_until_received(instrument, site, values):
    """Send a snapshot with these values again and again until the web server has received it."""

    def send_and_read():
        instrument.send(snapshot(time.monotonic(), **values))
        return site.services.feed.snapshot

    wait_for(send_and_read, lambda received: received is not None)
