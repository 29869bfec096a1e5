"""Non-blocking UDP socket that reports the receivers which have closed their port."""

from __future__ import annotations

import errno
import socket
import struct
from collections.abc import Iterator

from pneuforce.registers.rdt.streams import Address

MAX_DATAGRAM_BYTES = 64  #: a longer datagram is cut; no request is so long
MAX_ERRORS_READ = 8
_ERROR_BYTES = 512
#: Options IP_RECVERR and IPV6_RECVERR of Linux (ip(7), ipv6(7)), which the module socket does not define.
_RECEIVE_ERRORS = {socket.AF_INET: (socket.IPPROTO_IP, 11), socket.AF_INET6: (socket.IPPROTO_IPV6, 25)}
_ERRNO = struct.Struct("=I")  #: first field of sock_extended_err, ip(7)


class DatagramSocket:
    """UDP socket that never blocks.

    An ICMP message *port unreachable* shows that the receiver of a datagram has closed its port. Linux stores
    this message in the error queue of the socket, together with the address of the receiver.
    """

    def __init__(self, host: str, port: int) -> None:
        """Open the socket. Prefer IPv4 if the name `host` has several addresses. Raises OSError."""
        found = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM, flags=socket.AI_PASSIVE)
        family, kind, protocol, _, address = min(found, key=lambda info: info[0] != socket.AF_INET)
        self._socket = socket.socket(family, kind, protocol)
        try:
            self._socket.setblocking(False)
            self._socket.setsockopt(*_RECEIVE_ERRORS[socket.AF_INET], 1)  # also for IPv4 clients on "::"
            if family == socket.AF_INET6:
                self._socket.setsockopt(*_RECEIVE_ERRORS[socket.AF_INET6], 1)
            self._socket.bind(address)
        except OSError:
            self._socket.close()
            raise

    @property
    def port(self) -> int:
        """Return the port. If the socket was opened with port 0, the system has selected a port."""
        port: int = self._socket.getsockname()[1]
        return port

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()

    def receive(self, max_datagrams: int) -> Iterator[tuple[bytes, Address]]:
        """Yield up to `max_datagrams` waiting datagrams with their senders."""
        for _ in range(max_datagrams):
            try:
                yield self._socket.recvfrom(MAX_DATAGRAM_BYTES)
            except BlockingIOError:
                return
            except OSError:  # an error of an earlier send
                continue

    def send(self, data: bytes, address: Address) -> bool:
        """Send a datagram. Return False if the datagram was not sent."""
        for _ in range(2):  # the first attempt can fail because of an earlier datagram to another receiver
            try:
                self._socket.sendto(data, address)
                return True
            except BlockingIOError:
                return False
            except OSError:
                continue
        return False

    def closed_receivers(self) -> Iterator[Address]:
        """Yield the receivers that have closed their port since the last call."""
        for _ in range(MAX_ERRORS_READ):
            try:
                _, errors, _, address = self._socket.recvmsg(
                    MAX_DATAGRAM_BYTES, _ERROR_BYTES, socket.MSG_ERRQUEUE
                )
            except OSError:  # the queue is empty
                return
            if any(_is_refused(level, kind, data) for level, kind, data in errors):
                yield address


def _is_refused(level: int, kind: int, data: bytes) -> bool:
    known = (level, kind) in _RECEIVE_ERRORS.values() and len(data) >= _ERRNO.size
    return known and _ERRNO.unpack_from(data)[0] == errno.ECONNREFUSED
