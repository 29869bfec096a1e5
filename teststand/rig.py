"""A running instrument on a simulated rig, as the tests of PLC and robot programs drive it."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack, contextmanager
from typing import Any

from instrument.errors import PneuforceError
from instrument.faults import name_of
from registers.modbus.client import Plc
from sim.remote import Remote
from teststand.stack import Stack

LOOK_S = 0.02
VENT_S = 10.0
INFLATE_S = 20.0
JOIN_S = 5.0  #: for the CAN node to find its id free
PRESS_S = 5.0
SETTLED_S = 0.6  #: five times the lag of 0.12 s between a force and what the instrument shows of it

Values = dict[str, Any]


class NotInTime(PneuforceError, TimeoutError):
    """What was waited for did not come."""


class Tripped(PneuforceError):
    """The rig has tripped and cannot be inflated."""


class NotHeld(PneuforceError):
    """The balloon is not held, so that a press means nothing to the instrument."""


class LiveRig:
    """The instrument's face, and the hand, the faults and the truth of the rig behind it.

    Whatever is not possible raises a sentence: PlcError where the instrument refuses (with the reason's
    name), Refused where the simulator does, ChildFailed where one of the processes has ended.
    """

    def __init__(self, stack: Stack, unit: int = 1) -> None:
        """Drive this stack; `unit` is its Modbus unit."""
        self.modbus_port = stack.modbus_port
        self._stack = stack
        self._unit = unit
        self._remote = Remote(stack.control_port)

    # ---- the instrument

    @property
    def can(self) -> Values:
        """Arguments of python-can's `Bus`; waits until the instrument sends. Raises NotInTime."""
        self.wait_for(lambda registers: "can_down" not in registers["status"], JOIN_S)
        at = {"interface": "socketcand", "channel": "can0", "host": "127.0.0.1", "port": self._stack.can_port}
        return {**at, "tcp_tune": True, "ignore_config": True}

    def read(self) -> Values:
        """Value of every register by name, in the quantity's unit (N, kPa, mm, s); NaN is not available."""
        with self._plc() as plc:
            return plc.read_all()

    def write(self, name: str, value: object) -> None:
        """Write a register by name: a number in the quantity's unit, or the name of a code."""
        with self._plc() as plc:
            plc.write(name, value)

    def wait_for(self, wanted: Callable[[Values], bool], timeout_s: float = 10.0) -> Values:
        """The registers as soon as `wanted(registers)` holds. Raises NotInTime."""
        with self._plc() as plc:
            return _awaited(plc.read_all, wanted, timeout_s, _in_words)

    def inflate(self, setpoint_kpa: float) -> None:
        """Vent, take the zero, and inflate until the balloon is held. Raises NotInTime, Tripped."""
        with self._plc() as plc:
            plc.write("mode", "vent")
            _awaited(lambda: _untripped(plc), _vented_and_zeroed, VENT_S, _in_words)
            plc.write("setpoint_requested", setpoint_kpa)
            plc.write("mode", "hold")
            _awaited(lambda: _untripped(plc), lambda r: r["state"] == "holding", INFLATE_S, _in_words)

    def vent(self) -> None:
        """Vent, and wait until the instrument has verified it. Raises NotInTime."""
        self.write("mode", "vent")
        self.wait_for(lambda registers: "vented" in registers["status"], VENT_S)

    # ---- the world

    def press(self, force_n: float, wait: bool = True) -> None:
        """Press a held balloon with this force until it is released. Raises NotHeld, Tripped, NotInTime.

        With `wait` it comes back when the force stands, and the instrument has had time to follow; where the
        press trips the rig, it raises Tripped. `contact` presses whatever state the balloon is in.
        """
        registers = self._untripped()
        if registers["state"] != "holding":
            raise NotHeld(f"the balloon is not held, inflate it first: {_in_words(registers)}")
        self._remote.order(press=force_n)
        if wait:
            self._settle(force_n)
            self._untripped()

    def release(self, wait: bool = True) -> None:
        """Let go. `wait` as for `press`."""
        self._remote.order(release=True)
        if wait:
            self._settle(0.0)

    def contact(self, **contact: Any) -> None:
        """Begin one contact, written as in a scenario: `kind="tap", force_n=1.5`; comes back at once."""
        self._remote.order(contact=contact)

    def fault(self, name: str, **arguments: float) -> AbstractContextManager[Any]:
        """Put in a fault of the catalogue (`pneuforce fault --list`); the end of a `with` takes it out."""
        self._remote.order(fault={"name": name, **arguments})
        present = ExitStack()
        present.callback(self.fault_off, name)
        return present

    def fault_off(self, name: str) -> None:
        """Take a fault out."""
        self._remote.order(fault={"name": name, "on": False})

    def truth(self) -> Values:
        """What is really so at the next sample: `force_n`, `initial_kpa`, `indentation_mm` and more."""
        return self._remote.truth()

    # ---- how

    @contextmanager
    def _plc(self) -> Iterator[Plc]:
        """A connection for each question: an instrument closes those that are idle."""
        self._stack.check()
        with Plc.connect(port=self.modbus_port, unit=self._unit) as plc:
            yield plc

    def _untripped(self) -> Values:
        with self._plc() as plc:
            return _untripped(plc)

    def _settle(self, force_n: float) -> None:
        def told(truth: Values) -> str:
            return f"the hand presses with {truth['applied_n']:.3f} N, {force_n:g} N was ordered"

        stands = _awaited(self.truth, lambda t: math.isclose(t["applied_n"], force_n), PRESS_S, told)
        _awaited(self.truth, lambda t: t["t_s"] >= stands["t_s"] + SETTLED_S, PRESS_S, told)


def _awaited(
    look: Callable[[], Values],
    wanted: Callable[[Values], bool],
    timeout_s: float,
    told: Callable[[Values], str],
) -> Values:
    until_s = time.monotonic() + timeout_s
    while not wanted(seen := look()):
        if time.monotonic() > until_s:
            raise NotInTime(f"what was waited for did not come in {timeout_s:g} s: {told(seen)}")
        time.sleep(LOOK_S)
    return seen


def _vented_and_zeroed(registers: Mapping[str, Any]) -> bool:
    return "vented" in registers["status"] and "not_zeroed" not in registers["status"]


def _untripped(plc: Plc) -> Values:
    registers = plc.read_all()
    if registers["state"] == "tripped":
        raise Tripped(f"the rig has tripped: {_fault_in_words(registers)}; remove its cause, clear it")
    return registers


def _fault_in_words(registers: Mapping[str, Any]) -> str:
    code = registers["first_fault"]
    return f"{name_of(code)} (fault {code})" if code else "no fault"


def _in_words(registers: Mapping[str, Any]) -> str:
    return (
        f"state {registers['state']}, pressure {registers['pressure']:.3f} kPa, "
        f"setpoint {registers['setpoint_requested']:.3f} kPa, force {registers['force']:.3f} N, "
        f"status {' '.join(sorted(registers['status'])) or 'none'}, refusal {registers['refusal']}, "
        f"{_fault_in_words(registers)}"
    )
