"""The socketcand protocol's text, without I/O: `< word word … >`, joined and split on the stream at will."""

from __future__ import annotations

import re

GREETING = b"< hi >"
OK = b"< ok >"
ECHO = b"< echo >"  #: asked and answered alike
NO_SUCH_BUS = b"< error could not open bus >"
NO_ROOM = b"< error too many clients >"
_LONGEST_MESSAGE = 200
_IDENTIFIER = re.compile(r"[0-7][0-9A-F]{2}|[01][0-9A-F]{7}", re.IGNORECASE)


class Decoder:
    """Takes the bytes as they come and hands out each message as its words; garbage is counted."""

    def __init__(self) -> None:
        self.garbage = 0
        self._rest = ""

    def feed(self, data: bytes) -> list[list[str]]:
        """Messages that `data` completes."""
        *whole, self._rest = (self._rest + data.decode("ascii", "replace")).split(">")
        messages = []
        for text in whole:
            before, mark, words = text.rpartition("<")
            self.garbage += bool(before.strip()) or not mark
            if mark:
                messages.append(words.split())
        if len(self._rest) > _LONGEST_MESSAGE:
            self.garbage += 1
            self._rest = ""
        return messages


def frame_of_send(words: list[str], t_s: float) -> bytes | None:
    """The message `frame` for the others, of one client's `send`; None where that is malformed.

    An identifier of three digits has 11 bits, one of eight 29.
    """
    if len(words) < 3 or words[0] != "send" or not _IDENTIFIER.fullmatch(words[1]):
        return None
    try:
        data = bytes(int(word, 16) for word in words[3:])
        length = int(words[2], 16)
    except ValueError:
        return None
    if len(data) != length or length > 8:
        return None
    return f"< frame {words[1].upper()} {t_s:.6f} {data.hex().upper()} >".encode("ascii")
