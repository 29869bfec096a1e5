"""Recorder for Modbus traffic, and writer of capture files that Wireshark reads."""

from __future__ import annotations

import select
import socket
import struct
import threading
from contextlib import contextmanager
from dataclasses import dataclass

RAW_IPV4 = 101  # LINKTYPE_RAW in libpcap
TCP, UDP = 6, 17
SERVER_ADDRESS = socket.inet_aton("10.0.0.1")
CLIENT_ADDRESS = socket.inet_aton("10.0.0.2")
MAX_SEGMENT_BYTES = 1400


@dataclass(frozen=True)
class Transfer:
    """Bytes sent in one direction over one connection."""

    connection: int
    answer: bool
    data: bytes


@contextmanager
def recorded_port(port):
    """Yield a port whose connections are forwarded to `port`, and the list to which transfers are added."""
    transfers = []
    with socket.create_server(("127.0.0.1", 0), backlog=128) as listener:
        threading.Thread(target=_accept, args=(listener, port, transfers), daemon=True).start()
        try:
            yield listener.getsockname()[1], transfers
        finally:
            listener.shutdown(socket.SHUT_RDWR)


def _accept(listener, port, transfers):
    connection = 0
    while True:
        try:
            client, _ = listener.accept()
        except OSError:
            return
        connection += 1
        server = socket.create_connection(("127.0.0.1", port))
        threading.Thread(target=_forward, args=(connection, client, server, transfers), daemon=True).start()


def _forward(connection, client, server, transfers):
    """Forward bytes in both directions until one side closes."""
    with client, server:
        while True:
            for source in select.select([client, server], [], [])[0]:
                try:
                    data = source.recv(65536)
                    other = client if source is server else server
                    if data:
                        transfers.append(Transfer(connection, source is server, data))
                        other.sendall(data)
                except OSError:
                    data = b""
                if not data:
                    return


def split_answers(transfers):
    """Yield the requests unchanged, and one transfer per answer. The header gives the length of an answer."""
    rest = {}
    for transfer in transfers:
        if not transfer.answer:
            yield transfer
            continue
        data = rest.get(transfer.connection, b"") + transfer.data
        while len(data) >= 6 and len(data) >= (size := 6 + int.from_bytes(data[4:6], "big")):
            yield Transfer(transfer.connection, True, data[:size])
            data = data[size:]
        rest[transfer.connection] = data
    assert not any(rest.values())


def tcp_capture(transfers, port=502):
    """Return a capture file of TCP connections to a server on `port`."""
    sent = {}
    packets = []
    for transfer in transfers:
        direction = (transfer.connection, transfer.answer)
        opposite = (transfer.connection, not transfer.answer)
        for at in range(0, len(transfer.data), MAX_SEGMENT_BYTES):
            piece = transfer.data[at : at + MAX_SEGMENT_BYTES]
            ports = _ports(transfer, port)
            numbers = (sent.get(direction, 0) + 1, sent.get(opposite, 0) + 1)
            packets.append(
                _ip(transfer, TCP, struct.pack(">HHIIHHHH", *ports, *numbers, 0x5018, 8192, 0, 0) + piece)
            )
            sent[direction] = sent.get(direction, 0) + len(piece)
    return _file(packets)


def udp_capture(transfers, port=502):
    """Return a capture file with each frame in a UDP datagram."""
    return _file(
        _ip(
            transfer,
            UDP,
            struct.pack(">HHHH", *_ports(transfer, port), 8 + len(transfer.data), 0) + transfer.data,
        )
        for transfer in transfers
    )


def _ports(transfer, port):
    return (port, 10000 + transfer.connection) if transfer.answer else (10000 + transfer.connection, port)


def _ip(transfer, protocol, payload):
    addresses = (SERVER_ADDRESS, CLIENT_ADDRESS) if transfer.answer else (CLIENT_ADDRESS, SERVER_ADDRESS)
    return (
        struct.pack(">BBHHHBBH4s4s", 0x45, 0, 20 + len(payload), 0, 0, 64, protocol, 0, *addresses) + payload
    )


def _file(packets):
    head = struct.pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, 65535, RAW_IPV4)
    return head + b"".join(
        struct.pack("<IIII", 0, at, len(packet), len(packet)) + packet for at, packet in enumerate(packets)
    )
