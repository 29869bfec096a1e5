"""Interface of a connection to the instrument. Each bus has a module that implements this interface."""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import Literal, NamedTuple, Protocol

from pneuforce.client.details import Details
from pneuforce.client.latest_sample import LatestSample
from pneuforce.client.measurement import Measurement

Command = Literal["clear_faults", "zero_pressure", "new_balloon"]


class HoldRequest(NamedTuple):
    """Request of a program to hold the balloon."""

    setpoint_kpa: float
    lease_s: float
    proof_tests: bool  #: False forbids the proof tests during the hold


class SensorConnection(Protocol):
    """Connection over one bus. Its methods are called from several threads, and may block.

    Each method raises ConnectionLost if the instrument does not answer. A method that commands the instrument
    raises Rejected, or ReadOnlySensor over a bus that can only read.
    """

    @property
    def silence_s(self) -> float:
        """Return the time without a new sample after which the force is no longer valid."""
        ...

    @property
    def transmits_status(self) -> bool:
        """Return True if the bus transmits the status. Otherwise the status of a measurement is None."""
        ...

    def read(self) -> Measurement:
        """Return the latest measurement."""
        ...

    def sampling(self) -> AbstractContextManager[LatestSample]:
        """Return a context in which another thread receives the samples."""
        ...

    def vent(self) -> None:
        """Open the vent valve."""
        ...

    def prepare_hold(self, lease_s: float) -> None:
        """Take a lease, then vent. Raises Rejected, and changes nothing, if another peer has the lease."""
        ...

    def begin_hold(self, request: HoldRequest) -> None:
        """Request an inflation to the setpoint, after `prepare_hold`."""
        ...

    def renew_lease(self, lease_s: float) -> None:
        """Renew the lease, or end it with 0 s. This never inflates a balloon that was vented meanwhile."""
        ...

    def end_hold(self) -> None:
        """Vent, and end the lease. Another client that has the lease keeps it."""
        ...

    def release(self) -> None:
        """Vent, and end the lease. Raises Rejected, after the vent, if another client has the lease."""
        ...

    def set_setpoint(self, setpoint_kpa: float) -> None:
        """Write the setpoint of the present or of the next hold."""
        ...

    def set_force_limit(self, force_limit_n: float) -> None:
        """Write the limit of the force alarm."""
        ...

    def run_command(self, command: Command, argument: int = 0) -> None:
        """Run a command, and wait until the command is done."""
        ...

    def first_out_fault(self) -> int:
        """Return the code of the first-out fault, 0 if it is unknown or if there is no fault."""
        ...

    def details(self) -> Details:
        """Return the fault, the requested values, the lease and the versions, if the bus transmits them."""
        ...

    def close(self) -> None:
        """Close the connection."""
        ...
