"""Ports that nobody uses."""

import socket


def free_port():
    """A TCP port of the loopback that is free now."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return listener.getsockname()[1]
