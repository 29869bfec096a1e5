"""Raw socketcand client for tests of the hub."""

import socket


class RawHubClient:
    """TCP client that has received the greeting of the hub."""

    def __init__(self, port, receive_bytes=None):
        self.link = socket.socket()
        if receive_bytes:
            self.link.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_bytes)
        self.link.settimeout(15.0)
        self.link.connect(("127.0.0.1", port))
        assert self.read() == "< hi >"

    def join(self):
        """Complete the handshake."""
        assert self.ask("< open can0 >") == "< ok >"
        assert self.ask("< rawmode >") == "< ok >"
        return self

    def ask(self, text):
        self.send(text)
        return self.read()

    def send(self, text):
        self.link.sendall(text.encode())

    def read(self):
        """Read one message byte by byte, so that nothing after the message is read."""
        text = ""
        while not text.endswith(">"):
            text += self.link.recv(1).decode()
        return text

    def frames(self, count):
        """Read frames and return their text without the time stamps."""
        return [" ".join(part for i, part in enumerate(self.read().split()) if i != 3) for _ in range(count)]
