"""Streams of RDT records: which clients receive records, and how many. No I/O; time is an argument."""

from __future__ import annotations

from dataclasses import dataclass

from pneuforce.registers.rdt.record import encode_record, force_record

MAX_STREAMS = 4

Address = tuple[str | int, ...]  #: address of a UDP socket: host, port, and with IPv6 flow and scope


@dataclass(slots=True)
class RdtStream:
    """Stream to one client."""

    records_left: int  #: number of records until the stream ends; 0: no limit
    started_s: float  #: time of the last start request
    sequence: int = 0  #: number of records since the stream began


class RdtStreams:
    """Streams to up to four clients. A client is an address and a port."""

    def __init__(self, timeout_s: float = 0.0) -> None:
        """Create an empty set. A stream ends `timeout_s` after its last start request; 0: never."""
        self._timeout_s = timeout_s
        self._streams: dict[Address, RdtStream] = {}

    def __len__(self) -> int:
        """Return the number of streams."""
        return len(self._streams)

    @property
    def clients(self) -> dict[Address, int]:
        """Return the number of records that were sent to each client in its present stream."""
        return {address: stream.sequence for address, stream in self._streams.items()}

    def start(self, address: Address, sample_count: int, now_s: float) -> bool:
        """Start a stream of `sample_count` records (0: no limit). Return False if there are too many streams.

        A stream that is running gets the new number of records, and its sequence number continues. If the
        number restarted at 1, clients would discard the new records as older than those before.
        """
        stream = self._streams.get(address)
        if stream is not None:
            stream.records_left, stream.started_s = sample_count, now_s
            return True
        if len(self._streams) >= MAX_STREAMS:
            return False
        self._streams[address] = RdtStream(sample_count, now_s)
        return True

    def stop(self, address: Address) -> None:
        """End the stream to `address`. Unknown addresses are ignored."""
        self._streams.pop(address, None)

    def expire(self, now_s: float) -> None:
        """End all streams whose last start request is too old."""
        if self._timeout_s > 0.0:
            for address, stream in list(self._streams.items()):
                if not now_s - stream.started_s <= self._timeout_s:
                    self.stop(address)

    def next_records(self, ft_sequence: int, force_n: float) -> list[tuple[Address, bytes]]:
        """Return the datagram for each client. NaN as force gives records without a valid force."""
        datagrams = []
        for address, stream in list(self._streams.items()):
            stream.sequence += 1
            datagrams.append((address, encode_record(force_record(stream.sequence, ft_sequence, force_n))))
            if stream.records_left:
                stream.records_left -= 1
                if not stream.records_left:
                    self.stop(address)
        return datagrams
