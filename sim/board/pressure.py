"""The pressure control: the state machine at work, sample by sample."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from instrument.rig.frames import BoardState, Command, CommandFlag, Fault, Mode
from instrument.rig.limits import HARD_LIMIT_KPA, PRESSURISED, SETPOINT_PA
from sim.board.limits import GONE, LIMITS, Allowed, Limit
from sim.board.situation import Situation
from sim.board.states import FILLING, LOCKED, SAFE, TRANSITIONS, Happening

VENT_AFTER_MS = (250, 10_000)


class Change(NamedTuple):
    """A state entered, or a fault latched."""

    state: BoardState
    was: BoardState
    fault: Fault


@dataclass(slots=True)
class Pressure:
    """Obeys commands, keeps to the limits, drives the valves."""

    now: Situation = field(default_factory=Situation)
    changes: list[Change] = field(default_factory=list)  #: not yet told to the host
    _wanted_kpa: float = 0.0  # 0: nothing is wanted
    _armed: bool = False  # VENT was obeyed since boot, trip, greeting, vent message or silence while empty
    _clear: int | None = None  # last `clear` seen; the first one is the reference
    _broken: list[int] = field(default_factory=lambda: [0] * len(LIMITS))

    def restarted(self) -> None:
        """The board has booted although nobody asked for it."""
        self._trip(Fault.WATCHDOG)

    def greet(self) -> None:
        """A host has greeted, perhaps another: what the one before armed, zeroed and cleared is void."""
        self._armed = False
        self._clear = None
        self._happen(Happening.GREETED)
        if self.now.state not in PRESSURISED:
            self.now.reading.set_zero(0.0, False)

    def vent(self) -> None:
        """Vent, from any state."""
        self._armed = False
        self._wanted_kpa = 0.0
        self._happen(Happening.VENT_ASKED)

    def obey(self, command: Command) -> None:
        """Take over what the host wants."""
        now = self.now
        now.silent_s = 0.0
        now.in_contact = bool(command.flags & CommandFlag.IN_CONTACT)
        now.contact_limit_kpa = min(command.contact_limit_pa * 1e-3, HARD_LIMIT_KPA)
        now.vent_after_s = min(max(command.vent_after_ms, VENT_AFTER_MS[0]), VENT_AFTER_MS[1]) * 1e-3
        zeroed = bool(command.flags & CommandFlag.ZEROED)
        if now.state not in PRESSURISED:
            now.reading.set_zero(command.zero_pa * 1e-3, zeroed)
        self._clear_faults(command.clear)
        if command.mode == Mode.VENT:
            self.vent()
            self._armed = now.state is not BoardState.TRIPPED
        elif zeroed and SETPOINT_PA[0] <= command.setpoint_pa <= SETPOINT_PA[1]:
            self._wanted_kpa = command.setpoint_pa * 1e-3

    def _clear_faults(self, clear: int) -> None:
        """A new value clears what is gone. No valve moves: TRIPPED and VENTING are both SAFE."""
        before, self._clear = self._clear, clear
        if before is None or clear == before:
            return
        now = self.now
        now.latched = [fault for fault in now.latched if fault in GONE and not GONE[fault](now)]
        if not now.latched:
            self._happen(Happening.CLEARED)

    def step(self, adc_sum: int, supply_mv: int, dt_s: float) -> None:
        """One sample later."""
        now = self.now
        now.observe(adc_sum, supply_mv, dt_s)
        self._armed = self._armed and (now.heard or now.state in PRESSURISED)
        self._keep_to_limits()
        progress = _PROGRESS.get(now.state)
        happening = progress(self, dt_s) if progress else None
        if happening:
            self._happen(happening)
        now.valves = self._valves()

    def _keep_to_limits(self) -> None:
        now, broken = self.now, self._broken
        for index, limit, allowed in _KEPT_IN[now.state]:
            if allowed(now):
                broken[index] = 0
            elif now.state in limit.states:
                broken[index] += 1
                if broken[index] >= limit.samples and limit.fault not in now.latched:
                    self._trip(limit.fault)

    def _trip(self, fault: Fault) -> None:
        self._armed = False
        self._wanted_kpa = 0.0
        self.now.latched.append(fault)
        if not self._happen(Happening.TRIPPED, fault):
            self.changes.append(Change(self.now.state, self.now.state, fault))

    def _happen(self, happening: Happening, fault: Fault = Fault.NONE) -> bool:
        """Follow the table; False where the state's row does not name this."""
        was = self.now.state
        state = TRANSITIONS[was].get(happening)
        if state is None:
            return False
        self.now.state = state
        self._broken[:] = [
            n if state in limit.states else 0 for n, limit in zip(self._broken, LIMITS, strict=True)
        ]
        if state not in PRESSURISED:
            self.now.setpoint_kpa = 0.0
            self.now.filling.lock()
        self.changes.append(Change(state, was, fault))
        return True

    def _valves(self) -> int:
        if self.now.state in FILLING:
            return self.now.filling.valves
        return LOCKED if self.now.state is BoardState.HOLDING else SAFE

    def _emptying(self, dt_s: float) -> Happening | None:  # noqa: ARG002
        return Happening.EMPTY if self.now.vent.verified else None

    def _vented(self, dt_s: float) -> Happening | None:  # noqa: ARG002
        if not (self._armed and self._wanted_kpa and self.now.reading.zeroed and self.now.may_move):
            return None
        self._aim()
        return Happening.HOLD_ASKED

    def _inflating(self, dt_s: float) -> Happening | None:
        return self._fill(dt_s, self.now.filling.inflate)

    def _settling(self, dt_s: float) -> Happening | None:
        return self._fill(dt_s, lambda reading, kpa: self.now.filling.settle(reading, kpa, dt_s))

    def _fill(self, dt_s: float, drive: Callable[..., Happening | None]) -> Happening | None:
        now = self.now
        if self._retargeted:
            self._aim()
        now.filling.step(now.reading, dt_s)
        if not now.may_move:
            now.filling.lock()
            return None
        return drive(now.reading, now.setpoint_kpa)

    def _holding(self, dt_s: float) -> Happening | None:  # noqa: ARG002
        now = self.now
        if not (self._armed and now.may_move) or now.in_contact:
            return None
        if now.top_ups.due:
            now.top_ups.mend()
        elif not self._retargeted:
            return None
        self._aim()
        return Happening.RETARGETED

    @property
    def _retargeted(self) -> bool:
        return self._wanted_kpa != self.now.setpoint_kpa

    def _aim(self) -> None:
        self.now.setpoint_kpa = self._wanted_kpa
        self.now.filling.begin(self.now.reading)
        self.now.top_ups.low_s = 0.0


#: The limits of each state: place in `LIMITS`, limit, and its judgement.
_KEPT_IN: Mapping[BoardState, tuple[tuple[int, Limit, Allowed], ...]] = {
    state: tuple((n, limit, limit.allowed) for n, limit in enumerate(LIMITS) if state in limit.states)
    for state in BoardState
}
_PROGRESS: Mapping[BoardState, Callable[[Pressure, float], Happening | None]] = {
    BoardState.BOOT: Pressure._emptying,
    BoardState.VENTING: Pressure._emptying,
    BoardState.VENTED: Pressure._vented,
    BoardState.INFLATING: Pressure._inflating,
    BoardState.SETTLING: Pressure._settling,
    BoardState.HOLDING: Pressure._holding,
}
