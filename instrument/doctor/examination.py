"""Examination of a rig: clear old faults, observe the samples, and on request inflate, hold and vent."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from enum import Enum, auto
from typing import Any, NamedTuple

from pneuforce.instrument.core.controller import Instrument
from pneuforce.instrument.core.lease import Peer
from pneuforce.instrument.core.reject_reason import RejectReason
from pneuforce.instrument.rig.link import Link
from pneuforce.protocol.limits import adc_sum_is_valid, nominal_pressure_kpa

REPORT_S = 0.2  #: time from the first tick until the samples have reported the latched faults
CLEAR_TIMEOUT_S = 2.0  #: a cause that has just ended can persist for less than a second
CLEAR_EVERY_S = 0.2
OBSERVE_S = 5.0
LEAK_TEST_S = 20.0
#: Timeouts of the stages. The board has shorter timeouts, so that it trips first and reports the fault.
FILL_TIMEOUT_S, VENT_TIMEOUT_S, ZERO_TIMEOUT_S = 20.0, 12.0, 6.0
PEER: Peer = ("doctor", "local")


class ExaminationStage(Enum):
    """Stages of an examination, in their order."""

    CLEARING = auto()
    OBSERVING = auto()
    ZEROING = auto()
    FILLING = auto()
    LEAK_TEST = auto()
    VENTING = auto()
    DONE = auto()


class ExaminedSample(NamedTuple):
    """Quantities of one sample that the checks use."""

    stage: ExaminationStage
    t_s: float  #: host time at which the board took the sample
    received_s: float  #: host time at which the sample was read
    nominal_kpa: float  #: pressure according to the data sheet, before the zero adjustment
    pressure_kpa: float  #: unfiltered pressure after the zero adjustment
    supply_mv: int
    state: int
    valves: int
    clock_invalid: bool
    in_contact: bool  #: the instrument has detected a contact


class LinkLosses(NamedTuple):
    """Error counters of the link."""

    lost: int
    rejected: int


class Examination:
    """Output channel of the host process that collects each sample and runs the requested stages."""

    def __init__(
        self,
        instrument: Instrument,
        link: Link,
        obstacle: Callable[[Examination], str],
        inflate_kpa: float | None = None,
        observe_s: float = OBSERVE_S,
        leak_test_s: float = LEAK_TEST_S,
    ) -> None:
        """Prepare an examination.

        `inflate_kpa` is the setpoint for the test of the circuit. If it is None, no valve is moved.
        `obstacle` returns why the observed rig must not be inflated, "" if it may be inflated.
        """
        self._find_obstacle = obstacle
        self.obstacle = ""  #: why the rig was not inflated, although this was requested
        self.faults_before: tuple[int, ...] = ()  #: faults that were latched before the examination
        self.inflate_kpa = inflate_kpa
        self.leak_test_s = leak_test_s
        self.observe_s = observe_s
        self.samples: list[ExaminedSample] = []
        self.reject_reason = RejectReason.NONE  #: reason why the instrument rejected the inflation
        self.stage = ExaminationStage.CLEARING
        self.until_s = math.nan  #: time of the last tick before the examination was done
        self.instrument = instrument
        self.link = link
        self._since_s = math.nan
        self._clear_count = 0
        self._cleared_at_s = -math.inf
        self._losses_before = self._counters

    @property
    def _counters(self) -> LinkLosses:
        return LinkLosses(self.link.lost_frames, self.link.decoder.rejected_frames)

    @property
    def losses(self) -> LinkLosses:
        """Return the number of errors since the start of the examination."""
        now = self._counters
        return LinkLosses(now.lost - self._losses_before.lost, now.rejected - self._losses_before.rejected)

    @property
    def cleared(self) -> bool:
        """Return True if the faults that were latched before the examination could be cleared."""
        return self.instrument.peers.last_command(PEER).answer_state == "done"

    @property
    def done(self) -> bool:
        """Return True if all stages have ended."""
        return self.stage is ExaminationStage.DONE

    def samples_of(self, *stages: ExaminationStage) -> list[ExaminedSample]:
        """Return the samples of the given stages."""
        return [sample for sample in self.samples if sample.stage in stages]

    def on_sample(self, now_s: float) -> None:
        """Collect a new measurement."""
        raw = self.instrument.raw
        if raw is None or self.done:
            return
        sample = raw.message
        self.samples.append(
            ExaminedSample(
                self.stage,
                raw.t_s,
                now_s,
                nominal_pressure_kpa(sample.adc_sum) if adc_sum_is_valid(sample.adc_sum) else math.nan,
                self.instrument.measurement.unfiltered_kpa,
                sample.supply_mv,
                sample.state,
                sample.valves,
                raw.clock_invalid,
                self.instrument.measurement.in_contact,
            )
        )

    def tick(self, now_s: float) -> None:
        """Start the next stage if the present stage has ended."""
        if math.isnan(self._since_s):
            self._since_s = now_s
        if not self.done:
            self.until_s = now_s
        following = _STEPS[self.stage](self, now_s) if not self.done else None
        if following is not None:
            self.stage, self._since_s = following, now_s

    def _expired(self, now_s: float, limit_s: float) -> bool:
        """Return True if the present stage has lasted for at least `limit_s`."""
        return not now_s - self._since_s < limit_s

    def _clear(self, now_s: float) -> ExaminationStage | None:
        """Clear the faults that were latched before, again and again until this succeeds or lasts too long.

        A fault whose cause is present stays latched.
        """
        if not self._expired(now_s, REPORT_S):
            return None
        self.faults_before = self.faults_before or tuple(self.instrument.faults)
        if not self.faults_before or self.cleared:
            return ExaminationStage.OBSERVING
        if self.instrument.peers.last_command(PEER).answer_state == "busy":
            return None
        if self._expired(now_s, CLEAR_TIMEOUT_S):
            return ExaminationStage.OBSERVING
        if now_s - self._cleared_at_s >= CLEAR_EVERY_S:
            self._clear_count, self._cleared_at_s = self._clear_count + 1, now_s
            request = {
                "command_key": 1,
                "command_code": "clear_faults",
                "command_sequence": self._clear_count,
            }
            self.instrument.write(PEER, request, now_s)
        return None

    def _observe(self, now_s: float) -> ExaminationStage | None:
        if not self._expired(now_s, self.observe_s):
            return None
        if self.inflate_kpa is None:
            return ExaminationStage.DONE
        self.obstacle = self._find_obstacle(self)
        return ExaminationStage.DONE if self.obstacle else ExaminationStage.ZEROING

    def _zero(self, now_s: float) -> ExaminationStage | None:
        if self.instrument.chain.zero.taken and self.instrument.vented(now_s):
            self._write(now_s, mode="vent")
            self._write(now_s, setpoint_requested_kpa=self.inflate_kpa, mode="hold")
            accepted = self.reject_reason is RejectReason.NONE
            return ExaminationStage.FILLING if accepted else ExaminationStage.DONE
        return ExaminationStage.DONE if self._expired(now_s, ZERO_TIMEOUT_S) else None

    def _fill(self, now_s: float) -> ExaminationStage | None:
        if self.instrument.snapshot(PEER, now_s).state == "holding":
            return ExaminationStage.LEAK_TEST
        failed = self.instrument.tripped or self._expired(now_s, FILL_TIMEOUT_S)
        return self._vent(now_s) if failed else None

    def _test_leak(self, now_s: float) -> ExaminationStage | None:
        finished = self.instrument.tripped or self._expired(now_s, self.leak_test_s)
        return self._vent(now_s) if finished else None

    def _vent(self, now_s: float) -> ExaminationStage:
        self._write(now_s, mode="vent")
        return ExaminationStage.VENTING

    def _wait_until_vented(self, now_s: float) -> ExaminationStage | None:
        finished = self.instrument.vented(now_s) or self._expired(now_s, VENT_TIMEOUT_S)
        return ExaminationStage.DONE if finished else None

    def _write(self, now_s: float, **request: Any) -> None:
        """Write to the instrument, and keep the first reason for a rejection."""
        reject_reason = self.instrument.write(PEER, request, now_s)
        if self.reject_reason is RejectReason.NONE:
            self.reject_reason = reject_reason


_STEPS: Mapping[ExaminationStage, Callable[[Examination, float], ExaminationStage | None]] = {
    ExaminationStage.CLEARING: Examination._clear,
    ExaminationStage.OBSERVING: Examination._observe,
    ExaminationStage.ZEROING: Examination._zero,
    ExaminationStage.FILLING: Examination._fill,
    ExaminationStage.LEAK_TEST: Examination._test_leak,
    ExaminationStage.VENTING: Examination._wait_until_vented,
}
