"""Functions for tests with raw sockets."""


def is_closed(link):
    """Return True if the server closes the connection within 2 s after its last bytes."""
    link.settimeout(2.0)
    try:
        while link.recv(4096):
            pass
    except ConnectionError:
        return True
    except TimeoutError:
        return False
    return True
