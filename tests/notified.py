"""Receiver of the notifications that a service sends to $NOTIFY_SOCKET. Tests use it instead of systemd."""

import socket


class Manager:
    """Receiver of the notifications of a service."""

    def __init__(self, address):
        self.address = address
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind("\0" + address[1:] if address.startswith("@") else address)

    def heard(self):
        """Return the lines received since the last call."""
        lines = []
        while True:
            try:
                lines += self.socket.recv(4096, socket.MSG_DONTWAIT).decode().split("\n")
            except BlockingIOError:
                return lines
