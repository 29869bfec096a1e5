"""Pressure control: executes the state machine and checks the limits, sample by sample."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from pneuforce.protocol.frames import BoardState, Command, CommandFlag, Fault, Mode
from pneuforce.protocol.limits import HARD_LIMIT_KPA, PRESSURISED, SETPOINT_PA
from pneuforce.sim.board.board_status import BoardStatus
from pneuforce.sim.board.limits import CLEAR_CONDITIONS, LIMITS, Condition, Limit
from pneuforce.sim.board.states import FILLING, LOCKED, SAFE, TRANSITIONS, Trigger

HOST_TIMEOUT_MS = (250, 10_000)


class StateChange(NamedTuple):
    """Change of the state, or a fault that was latched without a change of the state."""

    state: BoardState
    previous_state: BoardState
    fault: Fault


@dataclass(slots=True)
class PressureController:
    """Controller that applies commands, enforces the limits and drives the valves."""

    status: BoardStatus = field(default_factory=BoardStatus)
    changes: list[StateChange] = field(default_factory=list)  #: changes that the host has not yet received
    _requested_kpa: float = 0.0  # 0: no setpoint is requested
    # A command with mode VENT arms the board. These events disarm the board: boot, trip, Identify, a Vent
    # message, and a silent host while the balloon is empty.
    _armed: bool = False
    _last_clear: int | None = None  # last `clear` value; the first value after Identify is the reference
    _last_test: int | None = None  # last `proof_test` value, with the same reference
    _test_requested: bool = False  # for the next sample only
    _violations: list[int] = field(default_factory=lambda: [0] * len(LIMITS))

    def latch_unexpected_reset(self) -> None:
        """Trip because the board was restarted by its watchdog or by a brown-out."""
        self._trip(Fault.WATCHDOG)

    def host_identified(self) -> None:
        """Disarm the board. Delete the zero, and the last values of `clear` and `proof_test`.

        The host may be a new host. An unfinished inflation is vented. A held balloon stays locked and keeps
        its zero.
        """
        self._armed = False
        self._last_clear = self._last_test = None
        self._apply_trigger(Trigger.IDENTIFIED)
        if self.status.state not in PRESSURISED:
            self.status.reading.set_zero(0.0, False)

    def vent(self) -> None:
        """Vent from any state."""
        self._armed = False
        self._requested_kpa = 0.0
        self._apply_trigger(Trigger.VENT_REQUESTED)

    def apply(self, command: Command) -> None:
        """Apply a command of the host."""
        status = self.status
        status.since_command_s = 0.0
        status.in_contact = bool(command.flags & CommandFlag.IN_CONTACT)
        status.contact_limit_kpa = min(command.contact_limit_pa * 1e-3, HARD_LIMIT_KPA)
        status.host_timeout_s = (
            min(max(command.host_timeout_ms, HOST_TIMEOUT_MS[0]), HOST_TIMEOUT_MS[1]) * 1e-3
        )
        zeroed = bool(command.flags & CommandFlag.ZEROED)
        if status.state not in PRESSURISED:
            status.reading.set_zero(command.zero_pa * 1e-3, zeroed)
        self._clear_faults(command.clear)
        self._test_requested = self._last_test not in (None, command.proof_test)
        self._last_test = command.proof_test
        if command.mode == Mode.VENT:
            self.vent()
            self._armed = status.state is not BoardState.TRIPPED
        elif zeroed and SETPOINT_PA[0] <= command.setpoint_pa <= SETPOINT_PA[1]:
            self._requested_kpa = command.setpoint_pa * 1e-3

    def _clear_faults(self, clear: int) -> None:
        """Clear the faults whose cause is gone, if the host has changed the value `clear`.

        A new value also deletes the record of top-ups, but not while the balloon is inflated. No valve moves,
        because the valves are SAFE in TRIPPED and in VENTING.
        """
        previous, self._last_clear = self._last_clear, clear
        if previous is None or clear == previous:
            return
        status = self.status
        if status.state not in PRESSURISED:
            status.top_ups.restart()
        status.latched_faults = [
            fault
            for fault in status.latched_faults
            if fault in CLEAR_CONDITIONS and not CLEAR_CONDITIONS[fault](status)
        ]
        if not status.latched_faults:
            self._apply_trigger(Trigger.CLEARED)

    def step(self, adc_sum: int, supply_mv: int, dt_s: float) -> None:
        """Process one sample and set the valves."""
        status = self.status
        status.update(adc_sum, supply_mv, dt_s)
        self._armed = self._armed and (status.host_active or status.state in PRESSURISED)
        self._check_limits()
        step_state = _STEP_BY_STATE.get(status.state)
        trigger = step_state(self, dt_s) if step_state else None
        if trigger:
            self._apply_trigger(trigger)
        self._test_requested = False
        status.valves = self._valves()

    def _check_limits(self) -> None:
        status, violations = self.status, self._violations
        for index, limit, condition in _LIMITS_BY_STATE[status.state]:
            if condition(status):
                violations[index] = 0
            elif status.state in limit.states:
                violations[index] += 1
                if violations[index] >= limit.samples and limit.fault not in status.latched_faults:
                    self._trip(limit.fault)

    def _trip(self, fault: Fault) -> None:
        self._armed = False
        self._requested_kpa = 0.0
        self.status.latched_faults.append(fault)
        if not self._apply_trigger(Trigger.TRIPPED, fault):
            self.changes.append(StateChange(self.status.state, self.status.state, fault))

    def _apply_trigger(self, trigger: Trigger, fault: Fault = Fault.NONE) -> bool:
        """Change the state as defined in `TRANSITIONS`. Return False if the state ignores the trigger."""
        previous_state = self.status.state
        state = TRANSITIONS[previous_state].get(trigger)
        if state is None:
            return False
        self.status.state = state
        self._violations[:] = [
            n if state in limit.states else 0 for n, limit in zip(self._violations, LIMITS, strict=True)
        ]
        if state not in PRESSURISED:
            self.status.setpoint_kpa = 0.0
            self.status.filling.lock()
        self.changes.append(StateChange(state, previous_state, fault))
        return True

    def _valves(self) -> int:
        if self.status.state in FILLING:
            return self.status.filling.valves
        if self.status.state is BoardState.TESTING:
            return self.status.proof_test.valves(self.status.may_move_valves)
        return LOCKED if self.status.state is BoardState.HOLDING else SAFE

    def _step_emptying(self, dt_s: float) -> Trigger | None:  # noqa: ARG002
        return Trigger.VENT_VERIFIED if self.status.vent.verified else None

    def _step_vented(self, dt_s: float) -> Trigger | None:  # noqa: ARG002
        status = self.status
        if not (self._armed and self._requested_kpa and status.reading.zeroed and status.may_move_valves):
            return None
        self._start_filling()
        return Trigger.HOLD_REQUESTED

    def _step_inflating(self, dt_s: float) -> Trigger | None:
        return self._step_filling(dt_s, self.status.filling.inflate)

    def _step_settling(self, dt_s: float) -> Trigger | None:
        return self._step_filling(dt_s, lambda reading, kpa: self.status.filling.settle(reading, kpa, dt_s))

    def _step_filling(self, dt_s: float, drive: Callable[..., Trigger | None]) -> Trigger | None:
        status = self.status
        if self._setpoint_changed:
            self._start_filling()
        status.filling.step(status.reading, dt_s)
        if not status.may_move_valves:
            status.filling.lock()
            return None
        return drive(status.reading, status.setpoint_kpa)

    def _step_holding(self, dt_s: float) -> Trigger | None:  # noqa: ARG002
        status = self.status
        if not (self._armed and status.may_move_valves) or status.in_contact:
            return None
        if status.top_ups.due:
            status.top_ups.record()
        elif not self._setpoint_changed:
            return self._start_test() if self._test_requested else None
        self._start_filling()
        return Trigger.RETARGETED

    def _start_test(self) -> Trigger:
        self.status.proof_test.start(self.status.setpoint_kpa, self.status.reading)
        return Trigger.TEST_REQUESTED

    def _step_testing(self, dt_s: float) -> Trigger | None:  # noqa: ARG002
        self.status.proof_test.step(self.status.reading)
        return Trigger.TEST_FINISHED if self.status.proof_test.finished else None

    @property
    def _setpoint_changed(self) -> bool:
        return self._requested_kpa != self.status.setpoint_kpa

    def _start_filling(self) -> None:
        self.status.setpoint_kpa = self._requested_kpa
        self.status.filling.start(self.status.reading)
        self.status.top_ups.low_s = 0.0


#: Limits that apply in each state: index in `LIMITS`, the limit, and its condition.
_LIMITS_BY_STATE: Mapping[BoardState, tuple[tuple[int, Limit, Condition], ...]] = {
    state: tuple((n, limit, limit.condition) for n, limit in enumerate(LIMITS) if state in limit.states)
    for state in BoardState
}
_STEP_BY_STATE: Mapping[BoardState, Callable[[PressureController, float], Trigger | None]] = {
    BoardState.BOOT: PressureController._step_emptying,
    BoardState.VENTING: PressureController._step_emptying,
    BoardState.VENTED: PressureController._step_vented,
    BoardState.INFLATING: PressureController._step_inflating,
    BoardState.SETTLING: PressureController._step_settling,
    BoardState.HOLDING: PressureController._step_holding,
    BoardState.TESTING: PressureController._step_testing,
}
