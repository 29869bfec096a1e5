"""Operations: what the command block can do to the instrument."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from instrument.arming import Step
from instrument.interlocks import violated
from instrument.refusal import Refusal

log = logging.getLogger("pneuforce")

if TYPE_CHECKING:
    from instrument.core import Instrument

CLEAR_HEARD_S = 0.1  #: time for the board to hear a clear and to say what remains
CLEAR_ANSWER_S = 0.5


class Operations:
    """The commands; each answers with a refusal, and only clearing takes time."""

    def __init__(self, instrument: Instrument) -> None:
        self._instrument = instrument
        self.clear_count = 0  #: what the board is told: a new value clears its faults
        #: Faults being cleared: the board may still report them. One that comes again is none of these.
        self.clearing: set[int] = set()
        self._clearing_since_s: float | None = None

    def run(self, code: str, argument: int, now_s: float) -> Refusal | None:
        """Run a command by its name; None where it is still busy, STATE for one that there is not."""
        run = _RUNS.get(code)
        return run(self, argument, now_s) if run else Refusal.STATE

    def _zero_pressure(self, argument: int, now_s: float) -> Refusal:  # noqa: ARG002
        own = self._instrument
        if own.measurement.in_contact:
            return Refusal.IN_CONTACT
        if own.link_lost(now_s):
            return Refusal.LINK_LOST
        if not own.chain.zero.take():
            return Refusal.STATE
        log.info("zero taken: the sensor reads %.3f kPa when vented", own.chain.zero.zero_kpa)
        return Refusal.NONE

    def _undo_zero(self, argument: int, now_s: float) -> Refusal:  # noqa: ARG002
        own = self._instrument
        return Refusal.NONE if own.vented(now_s) and own.chain.zero.undo() else Refusal.STATE

    def _self_test(self, argument: int, now_s: float) -> Refusal:  # noqa: ARG002
        own = self._instrument
        if own.link_lost(now_s) or own.raw is None:
            return Refusal.LINK_LOST
        if violated(own.raw, own.measurement, own.settings.contact_limit_kpa) is not None:
            return Refusal.CAUSE_PERSISTS
        return Refusal.NONE

    def _new_balloon(self, argument: int, now_s: float) -> Refusal:
        own = self._instrument
        if own.link_lost(now_s):
            return Refusal.LINK_LOST
        if not own.vented(now_s):
            return Refusal.STATE
        if argument != own.settings.identity.balloon_id:
            own.chain.uncalibrate()
        own.balloon_id, own.inflations = argument, 0
        return Refusal.NONE

    def _clear_faults(self, argument: int, now_s: float) -> Refusal | None:
        """Ask the board to clear; the answer comes with its samples. Never moves a valve."""
        own = self._instrument
        if own.vent_pending:
            return Refusal.IN_CONTACT
        if own.master_lost:
            return Refusal.CAUSE_PERSISTS
        failed = self._self_test(argument, now_s)
        if failed is not Refusal.NONE:
            return failed
        self.clear_count += 1
        self.clearing = set(own.faults)
        self._clearing_since_s = now_s
        return None

    @property
    def busy(self) -> bool:
        """Whether the board's answer to a clear is awaited."""
        return self._clearing_since_s is not None

    def finished(self, now_s: float) -> Refusal | None:
        """Result of a clear that has just ended, None where there is none."""
        own = self._instrument
        if self._clearing_since_s is None or own.sample is None:
            return None
        waited_s = now_s - self._clearing_since_s
        heard = own.sample.faults == 0 and waited_s >= CLEAR_HEARD_S
        if not heard and waited_s <= CLEAR_ANSWER_S:
            return None
        if heard and self._self_test(0, now_s) is Refusal.NONE:
            own.faults.clear(self.clearing)
        self.clearing = set()
        self._clearing_since_s = None
        if own.faults:
            return Refusal.CAUSE_PERSISTS
        own.advance(Step.CLEAR)
        return Refusal.NONE


_RUNS: Mapping[str, Callable[[Operations, int, float], Refusal | None]] = {
    "zero_pressure": Operations._zero_pressure,
    "clear_faults": Operations._clear_faults,
    "self_test": Operations._self_test,
    "undo_zero": Operations._undo_zero,
    "new_balloon": Operations._new_balloon,
}
