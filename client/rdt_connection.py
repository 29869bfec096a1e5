"""Connection to the instrument over RDT, which transmits only the force and cannot command the instrument."""

from __future__ import annotations

import math
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import NoReturn

from pneuforce.client.connection import Command, HoldRequest
from pneuforce.client.details import Details
from pneuforce.client.latest_sample import LatestSample
from pneuforce.client.measurement import Measurement, number_or_none
from pneuforce.errors import ConnectionFailed, ConnectionLost, ReadOnlySensor
from pneuforce.registers.rdt.record import RdtCommand, RdtRecord, decode_record, encode_request
from pneuforce.support.backlog import RECEIVE_TIMEOUT_S, Backlog

FIRST_RECORD_TIMEOUT_S = 1.0
SILENCE_LOST_S = 1.0
RENEWAL_S = 0.25  #: period of the start request, because the instrument can end a stream that is not renewed
LATE_RECORDS = 16  #: largest number of records by which the network can delay a record
COUNTER_VALUES = 1 << 32
RECORD_BYTES = 64  #: more than a record, so that a longer datagram is detected


class RdtSensorConnection:
    """Connection over RDT. A thread receives the records of a stream, from the first to the last call."""

    transmits_status = False

    def __init__(self, url: str, host: str, port: int, silence_s: float) -> None:
        """Request the stream and wait for the first record. Raises ConnectionFailed."""
        self.silence_s = silence_s
        self._url = url
        self._lock = threading.Lock()
        self._record: RdtRecord | None = None
        self._sample_s = self._received_s = -math.inf  #: times of the last new sample, and of the last record
        self._first = threading.Event()
        self._closing = threading.Event()
        self._backlog = Backlog()
        self._slots: tuple[LatestSample, ...] = ()
        self._socket = self._open_socket(host, port)
        self._thread = threading.Thread(target=self._receive, name="rdt-receive", daemon=True)
        self._thread.start()
        if not self._first.wait(FIRST_RECORD_TIMEOUT_S):
            self.close()
            raise ConnectionFailed(
                f"{url}: no record arrives; check that the instrument runs, that its section rdt is enabled, "
                "and that the section allows this computer"
            )

    def _open_socket(self, host: str, port: int) -> socket.socket:
        """Return a socket that receives only from the instrument. Raises ConnectionFailed."""
        try:
            family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
            receiver = socket.socket(family, kind, protocol)
            receiver.settimeout(RECEIVE_TIMEOUT_S)
            receiver.connect(address)
        except OSError as error:
            raise ConnectionFailed(f"{self._url}: {error.strerror or error}") from None
        return receiver

    def close(self) -> None:
        """Stop the stream and close the socket."""
        self._closing.set()
        self._thread.join(2 * RECEIVE_TIMEOUT_S)
        self._request(RdtCommand.STOP)
        self._socket.close()

    # ---- measure

    def read(self) -> Measurement:
        """Return the latest measurement. Raises ConnectionLost if no record arrives."""
        now_s = time.monotonic()
        with self._lock:
            record, age_s, silent_s = self._record, now_s - self._sample_s, now_s - self._received_s
        if record is None or silent_s > SILENCE_LOST_S:
            raise ConnectionLost(
                f"{self._url}: no record has arrived for {silent_s:.1f} s; check the instrument "
                "and the network"
            )
        return _measurement(record, age_s, self.silence_s)

    @contextmanager
    def sampling(self) -> Iterator[LatestSample]:
        """Receive the records while the context is active."""
        slot = LatestSample()
        with self._lock:
            self._slots = (*self._slots, slot)
        try:
            yield slot
        finally:
            with self._lock:
                self._slots = tuple(each for each in self._slots if each is not slot)
            slot.close()

    # ---- thread

    def _receive(self) -> None:
        requested_s = -math.inf
        while not self._closing.is_set():
            now_s = time.monotonic()
            if now_s > requested_s + RENEWAL_S:
                requested_s = now_s
                self._request(RdtCommand.START_REALTIME)
            with suppress(ValueError):  # a wrong datagram is ignored
                if data := self._next_datagram():
                    self._store(decode_record(data))

    def _next_datagram(self) -> bytes:
        """Return the next datagram, b"" without one. A lost stream is requested again by the caller."""
        self._socket.settimeout(self._backlog.timeout_s)
        try:
            data = self._socket.recv(RECORD_BYTES)
        except OSError:
            data = b""
        self._closing.wait(self._backlog.add(time.monotonic(), arrived=bool(data)))
        return data

    def _request(self, command: RdtCommand) -> None:
        with suppress(OSError):  # no instrument listens: the missing records show it
            self._socket.send(encode_request(command))

    def _store(self, record: RdtRecord) -> None:
        """Store a record. A late record is ignored.

        If the instrument receives no samples, its records repeat the last counter and have no valid force.
        """
        now_s = time.monotonic()
        with self._lock:
            before = self._record
            if before is not None and _is_late(record, before):
                return
            is_new = before is None or record.ft_sequence != before.ft_sequence
            self._record, self._received_s = record, now_s
            if self._backlog.possible:
                self._sample_s = -math.inf
            elif is_new:
                self._sample_s = now_s
            measurement = _measurement(record, now_s - self._sample_s, self.silence_s)
            slots = self._slots
        self._first.set()
        for slot in slots:
            slot.put(measurement)

    # ---- command

    def vent(self) -> None:
        """Raise ReadOnlySensor."""
        self._reject("vent")

    def prepare_hold(self, lease_s: float) -> None:  # noqa: ARG002
        """Raise ReadOnlySensor."""
        self._reject("hold")

    def begin_hold(self, request: HoldRequest) -> None:  # noqa: ARG002
        """Raise ReadOnlySensor."""
        self._reject("hold")

    def renew_lease(self, lease_s: float) -> None:  # noqa: ARG002
        """Raise ReadOnlySensor."""
        self._reject("renew a lease")

    def end_hold(self) -> None:
        """Do nothing, because this connection cannot hold the balloon."""

    def release(self) -> None:
        """Raise ReadOnlySensor."""
        self._reject("end a lease")

    def set_setpoint(self, setpoint_kpa: float) -> None:  # noqa: ARG002
        """Raise ReadOnlySensor."""
        self._reject("write a setpoint")

    def set_force_limit(self, force_limit_n: float) -> None:  # noqa: ARG002
        """Raise ReadOnlySensor."""
        self._reject("write the force limit")

    def run_command(self, command: Command, argument: int = 0) -> None:  # noqa: ARG002
        """Raise ReadOnlySensor."""
        self._reject(command)

    def first_out_fault(self) -> int:
        """Return 0, because RDT does not transmit the fault."""
        return 0

    def details(self) -> Details:
        """Return no details, because RDT does not transmit them."""
        return Details()

    def _reject(self, request: str) -> NoReturn:
        raise ReadOnlySensor(
            f"{self._url} cannot {request.replace('_', ' ')}, because RDT transmits only the force: "
            "connect to a tcp:// or can:// address to command the instrument"
        )


def _is_late(record: RdtRecord, before: RdtRecord) -> bool:
    return 0 < (before.rdt_sequence - record.rdt_sequence) % COUNTER_VALUES <= LATE_RECORDS


def _measurement(record: RdtRecord, age_s: float, silence_s: float) -> Measurement:
    """Return the measurement of a record. RDT transmits neither the status nor the reason."""
    if age_s > silence_s:
        return Measurement(age_s=number_or_none(age_s))
    return Measurement(force_or_nan=record.force_n, sample_counter=record.ft_sequence, age_s=age_s)
