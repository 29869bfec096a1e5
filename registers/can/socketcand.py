"""Text messages of the socketcand protocol, without I/O.

A message is `< word word … >`. TCP may join and split messages at any byte.
"""

from __future__ import annotations

import re

GREETING = b"< hi >"
OK = b"< ok >"
RAW_MODE = b"< rawmode >"  #: requests all frames of the bus
ECHO = b"< echo >"  #: the request and its response have the same text
NO_SUCH_BUS = b"< error could not open bus >"
TOO_MANY_CLIENTS = b"< error too many clients >"
_MAX_MESSAGE_CHARACTERS = 200
_IDENTIFIER = re.compile(r"[0-7][0-9A-F]{2}|[01][0-9A-F]{7}", re.IGNORECASE)


class SocketcandDecoder:
    """Decoder that receives bytes in any portions and returns complete messages. Invalid text is counted."""

    def __init__(self) -> None:
        self.garbage = 0
        self._rest = ""

    def feed(self, data: bytes) -> list[list[str]]:
        """Return the messages that `data` completes, each as a list of its words."""
        *complete, self._rest = (self._rest + data.decode("ascii", "replace")).split(">")
        messages = []
        for text in complete:
            before, mark, words = text.rpartition("<")
            self.garbage += bool(before.strip()) or not mark
            if mark:
                messages.append(words.split())
        self._rest = self._rest.lstrip()
        if self._rest and (self._rest[0] != "<" or len(self._rest) > _MAX_MESSAGE_CHARACTERS):
            self.garbage += 1
            self._rest = ""
        return messages


def open_message(channel: str) -> bytes:
    """Return the message that opens a bus of the server."""
    return f"< open {channel} >".encode("ascii")


def send_message(identifier: int, is_extended: bool, length: int, data: bytes | bytearray) -> bytes:
    """Return the `send` message of a client for one frame. `length` is the data length code."""
    number = f"{identifier:08X}" if is_extended else f"{identifier:03X}"
    words = " ".join(f"{byte:x}" for byte in data[:length])
    return f"< send {number} {length:X} {words} >".encode("ascii")


def frame_message(words: list[str], t_s: float) -> bytes | None:
    """Return the `frame` message that forwards a client's `send` message; None if `words` are malformed.

    `t_s` is the time of the frame [s since 1970]. An identifier of three digits has 11 bits, an identifier of
    eight digits has 29 bits.
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
