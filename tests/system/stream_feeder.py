"""Local socket that sends entries to a recorder, as the socket of an instrument does."""

import socket
import threading
import time
from contextlib import suppress
from pathlib import Path

from pneuforce.instrument.stream.entry import EntryDecoder, EntryKind, StreamEntry, encode, json_entry
from tests.instrument.recording.recording_files import HEADER, sample_body

SEND_INTERVAL_S = 0.01
SAMPLES_PER_INTERVAL = 5


class StreamFeeder:
    """Server that sends 500 samples per second to each recorder, with the time at which they are sent."""

    def __init__(self, path: Path):
        self.path, self.received = path, []
        self._server = socket.socket(socket.AF_UNIX)
        self._server.bind(str(path))
        self._server.listen()
        self._end, self._last_bytes = threading.Event(), b""
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self._end.set()
        with suppress(OSError):
            self._server.shutdown(socket.SHUT_RDWR)
        self._server.close()
        self._thread.join()

    def close_connection(self, last_bytes=b""):
        """Send the last bytes and close the connection. The socket continues to listen."""
        self._last_bytes = last_bytes
        self._end.set()

    def close_all(self):
        """Close the server and the connection, as when the instrument is killed."""
        self._server.close()
        self.close_connection()

    def _serve(self):
        while not self._end.is_set():
            with suppress(OSError):
                link, _ = self._server.accept()
                with link:
                    self._feed(link)

    def _feed(self, link):
        link.settimeout(5.0)
        self.received += EntryDecoder().feed(link.recv(65536))
        now_s = time.monotonic()
        checkpoint = StreamEntry(EntryKind.CHECKPOINT, now_s, b"state")
        link.sendall(encode(json_entry(EntryKind.HEADER, now_s, HEADER)) + encode(checkpoint))
        number = 0
        while not self._end.wait(SEND_INTERVAL_S):
            for _ in range(SAMPLES_PER_INTERVAL):
                number += 1
                now_s = time.monotonic()
                received = StreamEntry(EntryKind.RECEIVED, now_s, number.to_bytes(24, "little"))
                sample = StreamEntry(EntryKind.SAMPLE, now_s, sample_body(number))
                link.sendall(encode(received) + encode(sample))
        link.sendall(self._last_bytes)
        link.settimeout(0.2)
        with suppress(OSError):
            self.received += EntryDecoder().feed(link.recv(65536))
