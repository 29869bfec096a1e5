"""Connection to the instrument over Modbus TCP or RTU."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import partial
from typing import Any, TypeVar

from pneuforce.client.connection import Command, HoldRequest
from pneuforce.client.details import Details, details_of
from pneuforce.client.latest_sample import LatestSample
from pneuforce.client.measurement import Measurement, number_or_none, state_of, status_of
from pneuforce.client.rejection import rejected
from pneuforce.errors import ConnectionFailed, ConnectionLost, OtherRegisterMap, Rejected
from pneuforce.registers.map_hash import MAP_HASH
from pneuforce.registers.modbus.client import (
    ModbusClient,
    ModbusClientError,
    WriteRejectedError,
)

Result = TypeVar("Result")

POLL_S = 0.01
RECONNECT_S = 0.05  #: pause before another attempt to poll, if the connection is lost
_MEASURED = range(26)
_MAP_HASH = range(770, 772)
_FIRST_OUT_FAULT = range(778, 779)
_MAINTENANCE = range(74, 75)
_REQUESTED = range(512, 547)
_IDENTITY = range(768, 800)


class ModbusSensorConnection:
    """Connection over Modbus. Each request that may be repeated is tried a second time over a new connection.

    The second attempt is necessary because the instrument closes a connection that was idle for a minute.
    """

    transmits_status = True

    def __init__(
        self, url: str, open_client: Callable[[], ModbusClient], silence_s: float, *, any_map: bool = False
    ) -> None:
        """Open the connection. Raises ConnectionFailed, also for another register map unless `any_map`."""
        self.silence_s = silence_s
        self._url = url
        self._open_client = open_client
        self._replacement = threading.Lock()
        self._any_map = any_map
        self._closed = self._forbids_proof_tests = False
        self._client: ModbusClient | None = None
        try:
            self._client = self._open()
        except ModbusClientError as error:
            raise ConnectionFailed(f"{url}: {error}; {_hint(url)}") from None

    def _open(self) -> ModbusClient:
        """Return a new client. Raises ModbusClientError, and OtherRegisterMap for another register map."""
        client = self._open_client()
        try:
            map_hash = client.read_block(_MAP_HASH)["map_hash"]
        except ModbusClientError:
            client.close()
            raise
        if map_hash != MAP_HASH and not self._any_map:
            client.close()
            raise OtherRegisterMap(self._url, map_hash, MAP_HASH)
        return client

    def close(self) -> None:
        """Close the connection."""
        self._closed = True
        with self._replacement:
            client, self._client = self._client, None
        if client is not None:
            client.close()

    # ---- measure

    def read(self) -> Measurement:
        """Return the measurement of one request.

        An answer that has taken long possibly waited while this process was stopped. Then a second request
        decides.
        """
        begin_s = time.monotonic()
        values = self._read_measured()
        if time.monotonic() - begin_s > self.silence_s:
            values = self._read_measured()
        return _measurement(values)

    def _read_measured(self) -> dict[str, Any]:
        return self._repeatable(lambda client: client.read_block(_MEASURED))

    @contextmanager
    def sampling(self) -> Iterator[LatestSample]:
        """Poll in another thread while the context is active, also after a time without a connection."""
        slot, stop = LatestSample(), threading.Event()

        def poll() -> None:
            pause_s = POLL_S
            while not stop.wait(pause_s):
                try:
                    slot.put(self.read())
                    pause_s = POLL_S
                except ConnectionLost as error:
                    slot.fail(str(error))
                    pause_s = RECONNECT_S

        thread = threading.Thread(target=poll, name="modbus-poll", daemon=True)
        thread.start()
        try:
            yield slot
        finally:
            stop.set()
            slot.close()

    # ---- command

    def vent(self) -> None:
        """Open the vent valve, even if the instrument has another register map since a reconnection."""
        try:
            self._repeatable(ModbusClient.vent)
        except ConnectionLost as error:
            if not isinstance(error.__cause__, OtherRegisterMap):
                raise
            vent_once(self._url, self._open_client)

    def prepare_hold(self, lease_s: float) -> None:
        """Take a lease, then vent.

        The lease is taken first: if another client has the lease, its balloon is not vented.
        """
        self.renew_lease(lease_s)
        self.vent()

    def begin_hold(self, request: HoldRequest) -> None:
        """Write the setpoint, then request the inflation. The last write must not be repeated.

        One request for both registers would also write the force limit between them, for which a client with
        a role may have no right. After a rejected inflation, the setpoint therefore stays.
        """
        self._allow_proof_tests(request.proof_tests)
        self.set_setpoint(request.setpoint_kpa)
        self._once(lambda client: client.write("mode", "hold"))

    def renew_lease(self, lease_s: float) -> None:
        """Write the lease time; 0 ends the lease. This write never inflates a balloon."""
        self._repeatable(lambda client: client.write("lease", lease_s))

    def end_hold(self) -> None:
        """Vent, and end the lease. Another client that has the lease keeps it."""
        self.vent()
        with suppress(Rejected):
            if self._forbids_proof_tests:
                self._allow_proof_tests(True)
            self._end_lease()

    def release(self) -> None:
        """Vent, then write the lease time 0."""
        self.vent()
        self._end_lease()

    def _end_lease(self) -> None:
        self._repeatable(lambda client: client.write("lease", 0.0))

    def set_setpoint(self, setpoint_kpa: float) -> None:
        """Write the setpoint. This write never inflates a balloon that is vented."""
        self._repeatable(lambda client: client.write("setpoint_requested", setpoint_kpa))

    def set_force_limit(self, force_limit_n: float) -> None:
        """Write the limit of the force alarm. This write moves no valve."""
        self._repeatable(lambda client: client.write("force_limit", force_limit_n))

    def _allow_proof_tests(self, allowed: bool) -> None:
        proof_test = "allowed" if allowed else "forbidden"
        self._repeatable(lambda client: client.write("proof_test", proof_test))
        self._forbids_proof_tests = not allowed

    def run_command(self, command: Command, argument: int = 0) -> None:
        """Run a command. Raises Rejected."""
        reason = self._repeatable(lambda client: client.run_command(command, argument))
        if reason != "none":
            raise rejected(command, reason)

    def first_out_fault(self) -> int:
        """Return the code of the first-out fault."""
        return int(self._repeatable(lambda client: client.read_block(_FIRST_OUT_FAULT))["first_out_fault"])

    def details(self) -> Details:
        """Return the details of several requests."""
        values: dict[str, Any] = {}
        for block in (_MAINTENANCE, _REQUESTED, _IDENTITY):
            values |= self._repeatable(partial(ModbusClient.read_block, addresses=block))
        return details_of(values)

    # ---- requests

    def _repeatable(self, request: Callable[[ModbusClient], Result]) -> Result:
        """Return the result of a request. Repeat the request once over a new connection."""
        client = self._client
        try:
            return self._once(request)
        except ConnectionLost:
            self._replace(client)
            return self._once(request)

    def _once(self, request: Callable[[ModbusClient], Result]) -> Result:
        """Return the result of a request. Raises Rejected, ConnectionLost."""
        client = self._client
        if client is None:
            raise ConnectionLost(f"{self._url}: there is no connection; {_hint(self._url)}")
        try:
            return request(client)
        except WriteRejectedError as error:
            raise rejected(str(error).partition(" was rejected")[0], error.reason) from None
        except ModbusClientError as error:
            raise ConnectionLost(f"{self._url}: {error}; {_hint(self._url)}") from None

    def _replace(self, failed: ModbusClient | None) -> None:
        """Open a new connection, unless another thread has already replaced the failed connection."""
        with self._replacement:
            if self._client is not failed or self._closed:
                return
            if failed is not None:
                self._client = None
                failed.close()
            try:
                self._client = self._open()
            except OtherRegisterMap as error:
                raise ConnectionLost(str(error)) from error
            except ModbusClientError as error:
                raise ConnectionLost(f"{self._url}: {error}; {_hint(self._url)}") from None


def vent_once(url: str, open_client: Callable[[], ModbusClient]) -> None:
    """Vent over a new connection, without a check of the register map. Raises ConnectionFailed."""
    try:
        with open_client() as client:
            client.vent()
    except ModbusClientError as error:
        raise ConnectionFailed(f"{url}: {error}; {_hint(url)}") from None


def _hint(url: str) -> str:
    where = "cable, the unit and the baud rate" if url.startswith("rtu") else "address and the network"
    return f"check that the instrument runs, and check the {where}"


def _measurement(values: Mapping[str, Any]) -> Measurement:
    return Measurement(
        force_or_nan=values["force"],
        force_std_or_nan=values["force_uncertainty"] if math.isfinite(values["force"]) else math.nan,
        pressure_kpa=number_or_none(values["pressure"]),
        radius_mm=number_or_none(values["radius"]),
        setpoint_kpa=number_or_none(values["setpoint"]),
        state=state_of(values["state"]),
        status_or_none=status_of(values["status"]),
        sample_counter=values["sample_counter"],
        age_s=values["sample_age"],
    )
