"""RDT server: sends the force to clients that are written for ATI Net F/T and Axia sensors.

The server is read-only. No request changes anything of the instrument, and the only answers are records.
"""

from __future__ import annotations

import logging
import math
import time
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from pneuforce.registers.rdt.datagram_socket import DatagramSocket
from pneuforce.registers.rdt.options import RdtOptions
from pneuforce.registers.rdt.record import RdtCommand, RdtRequest, decode_request
from pneuforce.registers.rdt.streams import MAX_STREAMS, Address, RdtStreams
from pneuforce.registers.source import Peer, Source
from pneuforce.support.allow_list import AllowList
from pneuforce.support.counted import counted
from pneuforce.support.rejected_write import describe_write
from pneuforce.support.throttle import RateLimitedLogger

RDT_PEER = Peer("rdt")
MAX_REQUESTS_READ = 8  #: requests read at each sample and each tick, so that a flood costs a bounded time
STALE_PERIOD_S = 0.1  #: period of the records without a valid force while there are no samples
MAX_AGE_S = 0.1  #: an older force is not sent, as on CAN (`registers/can/transmit_queue.py`)
LOG_PERIOD_S = 60.0
MAX_LOGGED_BYTES = 16  #: bytes of a datagram that the log shows

NOT_ALLOWED = "its address is not in [rdt] allow: add the address, or stop the sender"
MALFORMED = "it is not a request of 8 bytes with the header 1234h: check which program sends it"
UNSUPPORTED = "its command is not supported: use the commands 0 to 3"
BIAS = "a new zero (bias) would hide a contact: subtract an offset in the client"
FULL = f"{MAX_STREAMS} clients already receive records: stop one of them"

_STARTS = frozenset((RdtCommand.START_SINGLE_BLOCK, RdtCommand.START_REALTIME, RdtCommand.START_BUFFERED))
_log = logging.getLogger(__name__)


@dataclass(slots=True)
class RdtCounters:
    """Counters of the server since its creation."""

    records: int = 0  #: records sent
    dropped: int = 0  #: records that the system did not accept
    requests: int = 0  #: datagrams received
    refused: int = 0  #: datagrams received that had no effect


class RdtServer:
    """Server for one source on one UDP port. The host calls the server for each sample and each tick.

    Each new sample gives one record for each client. While there are no samples, the clients receive records
    without a valid force, because many clients show the last force until the next record arrives.
    """

    def __init__(
        self, source: Source, options: RdtOptions, clock: Callable[[], float] = time.monotonic
    ) -> None:
        """Create the server without opening its port. `clock` is the clock of `on_sample` and `tick`."""
        self.options = options
        self.counters = RdtCounters()
        self.streams = RdtStreams(options.stream_timeout_s)
        self._source = source
        self._clock = clock
        self._allow_list = AllowList(options.allow)
        self._socket: DatagramSocket | None = None
        self._sent_s = -math.inf
        self._ft_sequence = 0
        self._loggers: defaultdict[str, RateLimitedLogger] = defaultdict(
            partial(RateLimitedLogger, _log, LOG_PERIOD_S)
        )

    def open(self) -> None:
        """Open the port. Raises OSError."""
        self._socket = DatagramSocket(self.options.host, self.options.port)

    @property
    def is_open(self) -> bool:
        """Return True if the port is open."""
        return self._socket is not None

    @property
    def port(self) -> int:
        """Return the UDP port. If option `port` is 0, the system selects a port."""
        assert self._socket is not None
        return self._socket.port

    def close(self) -> None:
        """End all streams and close the port.

        The last record of each stream has no valid force, because many clients show the last force for ever.
        """
        if self._socket is not None:
            self._send_records(self._ft_sequence, math.nan)
            self._socket.close()
            self._socket = None
            self.streams = RdtStreams(self.options.stream_timeout_s)

    def on_sample(self, now_s: float) -> None:
        """Send one record to each client."""
        self._receive(now_s)
        if self.streams:
            self._send(self._source.snapshot(RDT_PEER, now_s), now_s)

    def tick(self, now_s: float) -> None:
        """Handle the requests. If samples are missing, send records without a valid force."""
        self._receive(now_s)
        self.streams.expire(now_s)
        if self.streams and now_s - self._sent_s >= STALE_PERIOD_S:
            snapshot = self._source.snapshot(RDT_PEER, now_s)
            if "stale" in snapshot.status:
                self._send(snapshot, now_s)

    def _send(self, snapshot: Any, now_s: float) -> None:
        # a record has no bit for a force outside the range of the model
        valid = "force_valid" in snapshot.status and "out_of_range" not in snapshot.status
        valid = valid and self._clock() - now_s <= MAX_AGE_S  # a stall of this process can precede the send
        self._send_records(snapshot.sample_counter, snapshot.force_n if valid else math.nan)
        self._sent_s = now_s

    def _send_records(self, ft_sequence: int, force_n: float) -> None:
        if self._socket is None:
            return
        self._ft_sequence = ft_sequence
        for address, datagram in self.streams.next_records(ft_sequence, force_n):
            if self._socket.send(datagram, address):
                self.counters.records += 1
            else:
                self.counters.dropped += 1

    def _receive(self, now_s: float) -> None:
        if self._socket is None:
            return
        if self.streams:
            for address in self._socket.closed_receivers():
                self.streams.stop(address)
        for data, address in self._socket.receive(MAX_REQUESTS_READ):
            self.counters.requests += 1
            reason = self._handle(data, address, now_s)
            if reason:
                self.counters.refused += 1
                self._warn(reason, data, address, now_s)

    def _handle(self, data: bytes, address: Address, now_s: float) -> str:
        """Carry out a request. Return the reason if the request has no effect, otherwise an empty string."""
        if not self._allow_list.admits(str(address[0])):
            return NOT_ALLOWED
        request = decode_request(data)
        if request is None or not address[1]:  # a datagram with source port 0 cannot be answered
            return MALFORMED
        return self._execute(request, address, now_s)

    def _execute(self, request: RdtRequest, address: Address, now_s: float) -> str:
        if request.command in _STARTS:
            return "" if self.streams.start(address, request.sample_count, now_s) else FULL
        if request.command == RdtCommand.STOP:
            self.streams.stop(address)
            return ""
        if request.command == RdtCommand.RESET_THRESHOLD_LATCH:
            return ""  # no threshold ever latches
        return BIAS if request.command == RdtCommand.SET_BIAS else UNSUPPORTED

    def _warn(self, reason: str, data: bytes, address: Address, now_s: float) -> None:
        """Log a refused request. Each reason has its own limit, so that no flood hides another reason."""
        peer = Peer(RDT_PEER.channel, f"{address[0]}:{address[1]}")
        line = describe_write(peer, _describe_request(data), f"ignored, {reason}")
        self._loggers[reason].warning(now_s, "%s", line)


def _describe_request(data: bytes) -> str:
    """Return a request in words. Of another datagram, return the first bytes."""
    request = decode_request(data)
    if request is None:
        return f"{counted(len(data), 'byte')}, {data[:MAX_LOGGED_BYTES].hex(' ')}"
    return f"command {request.command}, sample count {request.sample_count}"
