"""A local socket that gives a tape, as an instrument's does, and says what it heard."""

import socket
import threading
import time
from contextlib import suppress
from pathlib import Path

from instrument.tape.entry import Decoder, Entry, Kind, encode, told
from tests.instrument.tape.taping import ABOUT, sample_body

EACH_S = 0.01
PER_TURN = 5


class Feeder:
    """Gives every recorder 500 samples a second, each with the moment at which it was given."""

    def __init__(self, path: Path):
        self.path, self.heard = path, []
        self._server = socket.socket(socket.AF_UNIX)
        self._server.bind(str(path))
        self._server.listen()
        self._end, self._last_words, self.pause = threading.Event(), b"", threading.Event()
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

    def finish(self, last_words=b""):
        """Say something last, and close."""
        self._last_words = last_words
        self._end.set()

    def go(self):
        """Close all, as an instrument that is killed."""
        self._server.close()
        self.finish()

    def _serve(self):
        while not self._end.is_set():
            with suppress(OSError):
                link, _ = self._server.accept()
                with link:
                    self._feed(link)

    def _feed(self, link):
        link.settimeout(5.0)
        self.heard += Decoder().feed(link.recv(65536))
        now_s = time.monotonic()
        link.sendall(encode(told(Kind.BEGIN, now_s, ABOUT)) + encode(Entry(Kind.CHECKPOINT, now_s, b"state")))
        number = 0
        while not self._end.wait(EACH_S):
            for _ in range(PER_TURN):
                number += 1
                now_s = time.monotonic()
                inputs = Entry(Kind.RECEIVED, now_s, number.to_bytes(24, "little"))
                link.sendall(encode(inputs) + encode(Entry(Kind.MEASURED, now_s, sample_body(number))))
        link.sendall(self._last_words)
        link.settimeout(0.2)
        with suppress(OSError):
            self.heard += Decoder().feed(link.recv(65536))
