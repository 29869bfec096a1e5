"""Connection to the instrument over CAN, with the frames of docs/robot.md."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from typing import Any

from pneuforce.client.can_receiver import CanReceiver
from pneuforce.client.connection import Command, HoldRequest
from pneuforce.client.details import Details, fault_of
from pneuforce.client.latest_sample import LatestSample
from pneuforce.client.measurement import Measurement
from pneuforce.client.rejection import COMMAND_PREFIX, rejected
from pneuforce.errors import ConnectionFailed, ConnectionLost, HoldEnded, OtherRegisterMap, UsageError
from pneuforce.registers.can.bus import CanAddress
from pneuforce.registers.can.connection import CanConnection
from pneuforce.registers.can.frames import COMMAND, encode
from pneuforce.registers.can.wire import CanFrame
from pneuforce.registers.codes import REJECT_REASONS
from pneuforce.registers.map_hash import MAP_HASH

FIRST_FRAMES_TIMEOUT_S = 2.0  #: the instrument sends the frame Identity each second
SILENCE_LOST_S = 1.0  #: time without any frame after which the connection is lost
FRAME_WAIT_S = 0.1  #: wait for the frames that arrived while this process was stopped
ANSWER_TIMEOUT_S = 0.1  #: time after which a Command is repeated (docs/robot.md)
MIN_ATTEMPTS = 3  #: attempts over a bus without any frame of the instrument
ATTEMPTS = 10  #: a busy computer can delay an Answer
COMMAND_ATTEMPTS = 40  #: a command, for example a zero adjustment, can take some seconds
_REJECTED = "rejected_"
_AT_ONCE = ("vent", "lease")


class CanSensorConnection:
    """Connection over CAN.

    All nodes of the bus are one holder of the lease. Therefore the lease is no longer renewed as soon as
    another node has sent a Command to vent.
    """

    transmits_status = True

    def __init__(self, url: str, address: CanAddress, node_id: int, silence_s: float) -> None:
        """Open the interface and wait for the frames of the node. Raises ConnectionFailed."""
        self.silence_s = silence_s
        self._url = url
        self._receiver = CanReceiver(node_id, silence_s)
        self._command_id = COMMAND.base_id + node_id
        self._bus = CanConnection(address, self._receive)
        self._sending = threading.Lock()
        self._exchange = threading.Lock()
        self._sequence = time.time_ns() & 0xFF
        self._vents = 0  #: number of Commands vent that this program has sent
        try:
            self._bus.open()
        except OSError as error:
            raise ConnectionFailed(
                f"{url}: {error}: check that the interface exists and is up, or that the server or hub runs"
            ) from None
        self._check_identity(node_id)

    def _receive(self, frame: CanFrame) -> None:
        self._receiver.receive(frame, may_be_old=self._bus.may_be_old)

    def _check_identity(self, node_id: int) -> None:
        map_hash = self._receiver.wait_for_identity(FIRST_FRAMES_TIMEOUT_S)
        if map_hash == MAP_HASH:
            return
        self.close()
        if map_hash is None:
            raise ConnectionFailed(
                f"{self._url}: node {node_id} does not send all frames; check that the instrument runs, that "
                "the node id is right, and that the mode of its CAN section is raw"
            )
        raise OtherRegisterMap(self._url, map_hash, MAP_HASH)

    def close(self) -> None:
        """Send the waiting frames and close the interface."""
        self._receiver.close()
        self._bus.close()

    # ---- measure

    def read(self) -> Measurement:
        """Return the latest measurement. Raises ConnectionLost if no frame arrives."""
        self._check_alive()
        return self._receiver.measurement()

    def _check_alive(self) -> None:
        age_s = self._receiver.silent_s()
        if age_s > SILENCE_LOST_S and not self._receiver.wait_for_frame(FRAME_WAIT_S):
            raise ConnectionLost(
                f"{self._url}: no frame has arrived for {age_s:.1f} s; check that the instrument runs, and "
                "check the CAN bus"
            )

    @contextmanager
    def sampling(self) -> Iterator[LatestSample]:
        """Receive the Force frames while the context is active."""
        slot = LatestSample()
        self._receiver.add(slot)
        try:
            yield slot
        finally:
            self._receiver.remove(slot)
            slot.close()

    # ---- command

    def vent(self) -> None:
        """Send the Command vent until its Answer arrives."""
        self._run({"mode": "vent"}, attempts=ATTEMPTS)

    def prepare_hold(self, lease_s: float) -> None:
        """Take a lease, then vent.

        The lease is taken first: if a client of another bus has the lease, its balloon is not vented.
        """
        self._run({"mode": "lease", "lease": lease_s}, attempts=ATTEMPTS)
        self._run({"mode": "vent", "lease": lease_s}, attempts=ATTEMPTS)

    def begin_hold(self, request: HoldRequest) -> None:
        """Request an inflation. The instrument executes a repeated Command only once."""
        proof_test = "allowed" if request.proof_tests else "forbidden"
        values = {"setpoint": request.setpoint_kpa, "lease": request.lease_s, "proof_test": proof_test}
        self._run({"mode": "hold", **values}, attempts=ATTEMPTS)

    def set_setpoint(self, setpoint_kpa: float) -> None:  # noqa: ARG002
        """Raise UsageError: a Command hold with a new setpoint could inflate after a vent of another node."""
        raise UsageError(
            f"{self._url} cannot write only a setpoint, because a CAN Command with a setpoint is a "
            "hold: end the hold and begin another, or connect to a tcp:// or rtu:// address"
        )

    def set_force_limit(self, force_limit_n: float) -> None:  # noqa: ARG002
        """Raise UsageError: a CAN Command has no field for the limit."""
        raise UsageError(
            f"{self._url} cannot write the force limit, because a CAN Command has no field for it: "
            "connect to a tcp:// or rtu:// address, or set force_limit_n in the configuration"
        )

    def renew_lease(self, lease_s: float) -> None:
        """Send the Command lease, if no other node has vented. Raises ConnectionLost, HoldEnded, Rejected."""
        if self._receiver.silent_s() > self.silence_s:
            raise ConnectionLost(f"{self._url}: no frame has arrived for {self.silence_s:g} s")
        if self._receiver.vented_by_another_node:
            raise HoldEnded("the balloon was vented, so its lease is not renewed")
        self._run({"mode": "lease", "lease": lease_s}, attempts=ATTEMPTS)

    def end_hold(self) -> None:
        """Vent, and end the lease."""
        self.vent()

    def release(self) -> None:
        """Vent, and end the lease of all nodes of this bus. Raises Rejected if another bus has the lease."""
        self.vent()
        self._run({"mode": "lease", "lease": 0.0}, attempts=ATTEMPTS)

    def run_command(self, command: Command, argument: int = 0) -> None:  # noqa: ARG002
        """Run a command. Raises Rejected, and UsageError for a command that CAN does not transmit."""
        if command == "new_balloon":
            raise UsageError(
                f"{self._url} cannot transmit the number of a balloon: connect to a tcp:// or rtu:// address"
            )
        self._run({"mode": command}, attempts=COMMAND_ATTEMPTS)

    def first_out_fault(self) -> int:
        """Return the code of the first fault in the Emergency frames since the connection was opened."""
        return self._receiver.first_out_fault

    def details(self) -> Details:
        """Return the fault of the Emergency frames, and the content of the frame Identity."""
        self._check_alive()
        identity = self._receiver.identity()
        return Details(
            first_out_fault=fault_of(self._receiver.first_out_fault),
            map_hash=identity["map_hash"],
            serial_number=identity["serial_number"],
        )

    def _run(self, values: dict[str, Any], *, attempts: int) -> None:
        """Send a Command until its Answer arrives. Raises Rejected, ConnectionLost.

        A vent and a lease do not wait for another Command to finish.
        """
        with nullcontext() if values["mode"] in _AT_ONCE else self._exchange:
            for _ in range(3):  # another program can have used the same sequence number for another Command
                result = self._send_until_answered(values, attempts)
                if result != "sequence_reused":
                    break
        if result not in ("accepted", "renewed"):
            raise rejected(f"{COMMAND_PREFIX}{values['mode']}", _reason(result))

    def _send_until_answered(self, values: dict[str, Any], attempts: int) -> str:
        """Return the result in the Answer."""
        is_vent = values["mode"] == "vent"
        with self._sending:
            self._sequence = sequence = (self._sequence + 1) & 0xFF
            self._vents += is_vent
            vents = self._vents
            fields = {"setpoint": 0.0, "lease": 0.0, "proof_test": "allowed", **values}
            data = encode(COMMAND, None, sequence=sequence, **fields)
            self._receiver.expect(sequence, is_vent)
        for attempt in range(attempts):
            if attempt >= MIN_ATTEMPTS and self._receiver.silent_s() > SILENCE_LOST_S:
                break
            with self._sending:
                self._check_not_vented(vents, values["mode"])
                self._bus.send(CanFrame(self._command_id, data))
            result = self._receiver.wait_for_answer(sequence, ANSWER_TIMEOUT_S)
            if result is not None:
                return result
        raise ConnectionLost(
            f"{self._url}: the instrument does not answer a Command; check the instrument and the CAN bus"
        )

    def _check_not_vented(self, vents: int, mode: str) -> None:
        """Raise HoldEnded if a vent was requested after a Command that is not a vent."""
        vented = self._vents != vents or (mode == "hold" and self._receiver.vented_by_another_node)
        if vented and mode != "vent":
            raise HoldEnded(f"the Command {mode} was cancelled by a vent")


def _reason(result: str) -> str:
    """Return the reject reason of a result."""
    name = result.removeprefix(_REJECTED)
    return name if name in REJECT_REASONS.codes else result
