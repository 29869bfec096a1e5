"""The socketcand protocol spoken byte by byte."""

import socket


class Client:
    """A raw TCP client that has shaken hands."""

    def __init__(self, port, receive_bytes=None):
        self.link = socket.socket()
        if receive_bytes:
            self.link.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_bytes)
        self.link.settimeout(15.0)
        self.link.connect(("127.0.0.1", port))
        assert self.read() == "< hi >"

    def join(self):
        assert self.ask("< open can0 >") == "< ok >"
        assert self.ask("< rawmode >") == "< ok >"
        return self

    def ask(self, text):
        self.send(text)
        return self.read()

    def send(self, text):
        self.link.sendall(text.encode())

    def read(self):
        """One message, byte by byte, so that nothing behind it is taken."""
        text = ""
        while not text.endswith(">"):
            text += self.link.recv(1).decode()
        return text

    def frames(self, how_many):
        return [
            " ".join(part for i, part in enumerate(self.read().split()) if i != 3) for _ in range(how_many)
        ]
