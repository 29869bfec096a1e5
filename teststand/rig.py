"""Running instrument on a simulated rig, with methods for tests of PLC and robot programs."""

from __future__ import annotations

import math
import signal
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from typing import Any

from pneuforce.client.value_checks import check_longest_wait
from pneuforce.errors import PneuforceError
from pneuforce.registers.modbus.client import ModbusClient
from pneuforce.sim.server.client import SimulatorClient
from pneuforce.teststand.conditions import (
    Values,
    check_untripped,
    describe,
    poll,
    read_untripped,
    vented,
    vented_and_zeroed,
)
from pneuforce.teststand.stack import Stack

VENT_TIMEOUT_S = 10.0
INFLATE_TIMEOUT_S = 20.0
CAN_TIMEOUT_S = 5.0  #: longest time in which the CAN node checks that its id is free
PRESS_TIMEOUT_S = 5.0
SETTLED_S = 0.6  #: five times 0.12 s, the time constant of the indicated force


class BalloonNotHeld(PneuforceError):
    """Error for a press on a balloon that is not held. The instrument would measure no force."""


class LiveRig:
    """Running instrument on a simulated rig, with methods to press the balloon and to inject faults.

    Methods raise ModbusClientError if the instrument rejects a request (with the name of the reason),
    SimulatorRequestError if the simulator rejects a request, and ChildProcessFailed if a process has ended
    without `kill_instrument`.
    These and all other exceptions of this class are subclasses of PneuforceError.
    """

    def __init__(self, stack: Stack, unit: int = 1) -> None:
        """Use the processes of `stack`; `unit` is the Modbus unit of the instrument."""
        self.modbus_port = stack.modbus_port
        self._stack = stack
        self._unit = unit
        self._simulator = SimulatorClient(stack.control_port)

    # ---- instrument

    @property
    def url(self) -> str:
        """Return the address of the instrument on Modbus TCP, for `pneuforce.connect`."""
        return f"tcp://127.0.0.1:{self.modbus_port}?unit={self._unit}"

    @property
    def can_url(self) -> str:
        """Return the address of the instrument on CAN, as soon as the CAN node sends. Raises WaitTimeout."""
        arguments = self.can_arguments
        return (
            f"can://{arguments['interface']}/{arguments['channel']}?host={arguments['host']}"
            f"&port={arguments['port']}&node={self._stack.can_node}"
        )

    @property
    def can_arguments(self) -> Values:
        """Return the arguments of python-can's `Bus` as soon as the CAN node sends. Raises WaitTimeout."""
        self.wait_for(lambda r: "can_down" not in r["status"], CAN_TIMEOUT_S, allow_trip=True)
        address = {"channel": "can0", "host": "127.0.0.1", "port": self._stack.can_port}
        return {"interface": "socketcand", **address, "tcp_tune": True, "ignore_config": True}

    @property
    def control_port(self) -> int:
        """Return the control port of the simulator (docs/simulator.md)."""
        return self._simulator.port

    def read(self) -> Values:
        """Return the values of the registers by name, in N, kPa, mm or s. NaN means not available.

        A register that repeats another one in a smaller unit is left out. Enumerations are names, and
        `first_out_fault` is the number of the fault.
        """
        with self._plc() as plc:
            return plc.read_all()

    def write(self, name: str, value: object) -> None:
        """Write a register by name. `value` is a number in N, kPa, mm or s, or a name, for example `vent`."""
        with self._plc() as plc:
            plc.write(name, value)

    def wait_for(
        self, condition: Callable[[Values], bool], timeout_s: float = 10.0, *, allow_trip: bool = False
    ) -> Values:
        """Wait until `condition(registers)` is true. Return the registers.

        If the rig has tripped and the condition is false, RigTripped is raised at once. With `allow_trip`,
        the wait continues after a trip. Raises WaitTimeout after `timeout_s`, and ConfigurationError if
        `timeout_s` is not a number of at least 0.
        """
        check_longest_wait(timeout_s)

        def reached(registers: Values) -> bool:
            if condition(registers):
                return True
            if not allow_trip:
                check_untripped(registers, "; to wait for a change of the tripped rig, use allow_trip=True")
            return False

        with self._plc() as plc:
            return poll(plc.read_all, reached, timeout_s, describe)

    def inflate(self, setpoint_kpa: float) -> None:
        """Vent, take the zero, inflate, and wait until the balloon is held.

        A balloon that another client holds is vented too. Raises WaitTimeout, RigTripped.
        """
        with self._plc() as plc:
            plc.write("mode", "vent")
            poll(lambda: read_untripped(plc), vented_and_zeroed, VENT_TIMEOUT_S, describe)
            plc.write("setpoint_requested", setpoint_kpa)
            plc.write("mode", "hold")
            poll(lambda: read_untripped(plc), lambda r: r["state"] == "holding", INFLATE_TIMEOUT_S, describe)

    def vent(self) -> None:
        """Vent, and wait until the instrument has verified the vent.

        Raises VentFailed as soon as the instrument reports a failed vent, and WaitTimeout.
        """
        self.write("mode", "vent")
        self.wait_for(vented, VENT_TIMEOUT_S, allow_trip=True)

    # ---- process of the instrument

    @contextmanager
    def pause_instrument(self) -> Iterator[None]:
        """Stop the process of the instrument (SIGSTOP) during a `with` block, and continue it (SIGCONT)."""
        self._stack.host.send(signal.SIGSTOP)
        try:
            yield
        finally:
            self._stack.host.send(signal.SIGCONT)

    def kill_instrument(self) -> None:
        """Kill the process of the instrument (SIGKILL). The simulator and the CAN hub continue."""
        self._stack.host.kill()

    def start_instrument(self) -> None:
        """Start the instrument again, on the same ports, and wait until it is ready.

        An instrument that runs is ended first (SIGTERM). Raises ChildProcessFailed.
        """
        self._stack.host.restart()
        self._stack.host.ready()

    # ---- simulated rig

    def press(self, force_n: float, wait: bool = True) -> None:
        """Press the held balloon with this force until `release`.

        With `wait`, return 0.6 s after the hand has reached the force. The instrument then indicates
        the force. To press a balloon in any state, use `start_contact`.

        At setpoints from 7.85 to 9.85 kPa, the indicated force differs from `truth()` by up to 15 %: the
        simulated balloon has the sudden step of the paper at 8.85 kPa, and the instrument changes gradually
        between the two parts of the law. To compare forces, press at another setpoint, for example 6.5 kPa.

        Raises BalloonNotHeld, WaitTimeout, and RigTripped if the rig has tripped or the press trips the rig.
        """
        with self._plc() as plc:
            registers = read_untripped(plc)
        if registers["state"] != "holding":
            raise BalloonNotHeld(f"the balloon is not held: {describe(registers)}; inflate the balloon first")
        self._request(press=force_n)
        if wait:
            self._wait_settled(force_n)
            check_untripped(self.read(), ". The hand presses until release() is called")

    def release(self, wait: bool = True) -> None:
        """End the contact. With `wait`, return 0.6 s after the hand has left the balloon."""
        self._request(release=True)
        if wait:
            self._wait_settled(0.0)

    def start_contact(self, kind: str = "tap", **contact: Any) -> None:
        """Start one contact and return at once. The arguments are the keys of a contact in a scenario.

        The hand moves in any state of the rig. An empty balloon has no force, so a contact that ends before
        the balloon is inflated has no effect. A contact during the inflation can trip the rig.

        Example: `start_contact(kind="tap", force_n=1.5)`.
        """
        self._request(contact={"kind": kind, **contact})

    def inject_fault(self, name: str, **arguments: float) -> AbstractContextManager[Any]:
        """Inject a fault of the catalogue (`pneuforce sim fault --list`).

        In a `with` statement, the end of the block removes the fault, if the fault is still active.
        """
        self._request(fault={"name": name, **arguments})
        removal = ExitStack()
        removal.callback(self._remove_if_active, name)
        return removal

    def remove_fault(self, name: str) -> None:
        """Remove a fault. Raises SimulatorRequestError if the fault is not active."""
        self._request(fault={"name": name, "on": False})

    def truth(self) -> Values:
        """Return the true state at the next sample: `force_n`, `baseline_kpa`, `indentation_mm` and more."""
        with self._stack.checked():
            return self._simulator.truth()

    # ---- implementation

    @contextmanager
    def _plc(self) -> Iterator[ModbusClient]:
        """Connect for one request, because the instrument closes idle connections."""
        with (
            self._stack.checked(),
            ModbusClient.connect(port=self.modbus_port, unit=self._unit) as plc,
        ):
            yield plc

    def _request(self, **request: Any) -> None:
        with self._stack.checked():
            self._simulator.request(**request)

    def _remove_if_active(self, name: str) -> None:
        with self._stack.checked():
            active = self._simulator.faults()
        if any(fault["name"] == name for fault in active):
            self.remove_fault(name)

    def _wait_settled(self, force_n: float) -> None:
        def describe_hand(truth: Values) -> str:
            return f"the hand presses with {truth['applied_n']:.3f} N instead of {force_n:g} N"

        reached = poll(
            self.truth, lambda t: math.isclose(t["applied_n"], force_n), PRESS_TIMEOUT_S, describe_hand
        )
        poll(self.truth, lambda t: t["t_s"] >= reached["t_s"] + SETTLED_S, PRESS_TIMEOUT_S, describe_hand)
