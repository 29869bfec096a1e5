"""Conversations with the instrument kept byte by byte, and written as a capture that Wireshark reads."""

from __future__ import annotations

import select
import socket
import struct
import threading
from contextlib import contextmanager
from dataclasses import dataclass

RAW_IPV4 = 101  # LINKTYPE_RAW of libpcap
TCP, UDP = 6, 17
OURS = socket.inet_aton("10.0.0.1")
THEIRS = socket.inet_aton("10.0.0.2")
MOST_IN_A_PACKET = 1400


@dataclass(frozen=True)
class Said:
    """Bytes that went one way over one connection."""

    connection: int
    answer: bool
    data: bytes


@contextmanager
def recording(port):
    """Yields the port of a line to the instrument's, and the list of all that goes over it."""
    said = []
    with socket.create_server(("127.0.0.1", 0), backlog=128) as listener:
        threading.Thread(target=_accept, args=(listener, port, said), daemon=True).start()
        try:
            yield listener.getsockname()[1], said
        finally:
            listener.shutdown(socket.SHUT_RDWR)


def _accept(listener, port, said):
    connection = 0
    while True:
        try:
            client, _ = listener.accept()
        except OSError:
            return
        connection += 1
        server = socket.create_connection(("127.0.0.1", port))
        threading.Thread(target=_carry, args=(connection, client, server, said), daemon=True).start()


def _carry(connection, client, server, said):
    """Pass on until one side ends."""
    with client, server:
        while True:
            for source in select.select([client, server], [], [])[0]:
                try:
                    data = source.recv(65536)
                    other = client if source is server else server
                    if data:
                        said.append(Said(connection, source is server, data))
                        other.sendall(data)
                except OSError:
                    data = b""
                if not data:
                    return


def answers(said):
    """The same, each answer by itself as its header's length tells."""
    rest = {}
    for one in said:
        if not one.answer:
            yield one
            continue
        data = rest.get(one.connection, b"") + one.data
        while len(data) >= 6 and len(data) >= (size := 6 + int.from_bytes(data[4:6], "big")):
            yield Said(one.connection, True, data[:size])
            data = data[size:]
        rest[one.connection] = data
    assert not any(rest.values())


def tcp_capture(said, port=502):
    """A capture file of conversations with a server on a port."""
    sent = {}
    packets = []
    for one in said:
        way = (one.connection, one.answer)
        back = (one.connection, not one.answer)
        for at in range(0, len(one.data), MOST_IN_A_PACKET):
            piece = one.data[at : at + MOST_IN_A_PACKET]
            ports = _ports(one, port)
            numbers = (sent.get(way, 0) + 1, sent.get(back, 0) + 1)
            packets.append(
                _ip(one, TCP, struct.pack(">HHIIHHHH", *ports, *numbers, 0x5018, 8192, 0, 0) + piece)
            )
            sent[way] = sent.get(way, 0) + len(piece)
    return _file(packets)


def udp_capture(said, port=502):
    """A capture file with each frame in a datagram."""
    return _file(
        _ip(one, UDP, struct.pack(">HHHH", *_ports(one, port), 8 + len(one.data), 0) + one.data)
        for one in said
    )


def _ports(one, port):
    return (port, 10000 + one.connection) if one.answer else (10000 + one.connection, port)


def _ip(one, protocol, payload):
    addresses = (OURS, THEIRS) if one.answer else (THEIRS, OURS)
    return (
        struct.pack(">BBHHHBBH4s4s", 0x45, 0, 20 + len(payload), 0, 0, 64, protocol, 0, *addresses) + payload
    )


def _file(packets):
    head = struct.pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, 65535, RAW_IPV4)
    return head + b"".join(
        struct.pack("<IIII", 0, at, len(packet), len(packet)) + packet for at, packet in enumerate(packets)
    )
