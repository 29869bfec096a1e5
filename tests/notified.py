"""The end of $NOTIFY_SOCKET that is systemd's."""

import socket


class Manager:
    """Hears what a service says, as systemd would."""

    def __init__(self, address):
        self.address = address
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind("\0" + address[1:] if address.startswith("@") else address)

    def heard(self):
        """The lines that have come since."""
        lines = []
        while True:
            try:
                lines += self.socket.recv(4096, socket.MSG_DONTWAIT).decode().split("\n")
            except BlockingIOError:
                return lines
