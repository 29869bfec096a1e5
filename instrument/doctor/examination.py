"""The examination of a rig: listen, and where it was asked for inflate, hold and vent."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from enum import Enum, auto
from typing import Any, NamedTuple

from instrument.core import Instrument
from instrument.lease import Peer
from instrument.refusal import Refusal
from instrument.rig.limits import alive, nominal_pressure_kpa
from instrument.rig.link import Link

LISTEN_S = 5.0
LEAK_S = 20.0
#: Longer than the board itself allows each of them: it trips first, and says why.
FILL_S, VENT_S, ZERO_S = 20.0, 12.0, 6.0
PEER: Peer = ("doctor", "local")


class Stage(Enum):
    """What is being done."""

    LISTENING = auto()
    ZEROING = auto()
    FILLING = auto()
    LEAKING = auto()
    VENTING = auto()
    DONE = auto()


class Row(NamedTuple):
    """One sample, as far as the checks look at it."""

    stage: Stage
    t_s: float  #: when the board took it, by the host's clock
    heard_s: float  #: when it was read
    nominal_kpa: float  #: by the data sheet, before the zero
    pressure_kpa: float  #: unfiltered, after the zero
    supply_mv: int
    state: int
    valves: int
    frozen: bool
    pressed: bool  #: the instrument sees a contact


class Losses(NamedTuple):
    """What the link has counted."""

    lost: int
    refused: int


class Examination:
    """A face of the host: it hears each sample, and asks for a pressure where that was asked of it."""

    def __init__(
        self,
        instrument: Instrument,
        link: Link,
        inflate_kpa: float | None = None,
        listen_s: float = LISTEN_S,
        leak_s: float = LEAK_S,
    ) -> None:
        """`inflate_kpa` is the setpoint of the test of the circuit; without one no valve is moved."""
        self.inflate_kpa = inflate_kpa
        self.leak_s = leak_s
        self.listen_s = listen_s
        self.rows: list[Row] = []
        self.refusal = Refusal.NONE  #: why the instrument did not inflate
        self.stage = Stage.LISTENING
        self.until_s = math.nan  #: up to when it was looked
        self.instrument = instrument
        self.link = link
        self._since_s = math.nan
        self._before = self._counted

    @property
    def _counted(self) -> Losses:
        return Losses(self.link.lost_frames, self.link.decoder.refused)

    @property
    def losses(self) -> Losses:
        """What was lost since it began."""
        now = self._counted
        return Losses(now.lost - self._before.lost, now.refused - self._before.refused)

    @property
    def done(self) -> bool:
        """Whether there is no more to come."""
        return self.stage is Stage.DONE

    def rows_of(self, *stages: Stage) -> list[Row]:
        """What was heard in these stages."""
        return [row for row in self.rows if row.stage in stages]

    def on_sample(self, now_s: float) -> None:
        """A new measurement is there."""
        raw = self.instrument.raw
        if raw is None or self.done:
            return
        sample = raw.message
        self.rows.append(
            Row(
                self.stage,
                raw.t_s,
                now_s,
                nominal_pressure_kpa(sample.adc_sum) if alive(sample.adc_sum) else math.nan,
                self.instrument.measurement.unfiltered_kpa,
                sample.supply_mv,
                sample.state,
                sample.valves,
                raw.frozen,
                self.instrument.measurement.in_contact,
            )
        )

    def tick(self, now_s: float) -> None:
        """Time has passed: go on to the next stage where this one is over."""
        if math.isnan(self._since_s):
            self._since_s = now_s
        if not self.done:
            self.until_s = now_s
        following = _STEPS[self.stage](self, now_s) if not self.done else None
        if following is not None:
            self.stage, self._since_s = following, now_s

    def _passed(self, now_s: float, limit_s: float) -> bool:
        return not now_s - self._since_s < limit_s

    def _listen(self, now_s: float) -> Stage | None:
        if not self._passed(now_s, self.listen_s):
            return None
        return Stage.DONE if self.inflate_kpa is None else Stage.ZEROING

    def _zero(self, now_s: float) -> Stage | None:
        if self.instrument.chain.zero.taken and self.instrument.vented(now_s):
            self._ask(now_s, mode="vent")
            self._ask(now_s, setpoint_requested_kpa=self.inflate_kpa, mode="hold")
            return Stage.FILLING if self.refusal is Refusal.NONE else Stage.DONE
        return Stage.DONE if self._passed(now_s, ZERO_S) else None

    def _fill(self, now_s: float) -> Stage | None:
        if self.instrument.snapshot(PEER, now_s).state == "holding":
            return Stage.LEAKING
        return self._vent(now_s) if self.instrument.tripped or self._passed(now_s, FILL_S) else None

    def _leak(self, now_s: float) -> Stage | None:
        tripped = self.instrument.tripped
        return self._vent(now_s) if tripped or self._passed(now_s, self.leak_s) else None

    def _vent(self, now_s: float) -> Stage:
        self._ask(now_s, mode="vent")
        return Stage.VENTING

    def _empty(self, now_s: float) -> Stage | None:
        return Stage.DONE if self.instrument.vented(now_s) or self._passed(now_s, VENT_S) else None

    def _ask(self, now_s: float, **request: Any) -> None:
        refusal = self.instrument.write(PEER, request, now_s)
        self.refusal = refusal if self.refusal is Refusal.NONE else self.refusal


_STEPS: Mapping[Stage, Callable[[Examination, float], Stage | None]] = {
    Stage.LISTENING: Examination._listen,
    Stage.ZEROING: Examination._zero,
    Stage.FILLING: Examination._fill,
    Stage.LEAKING: Examination._leak,
    Stage.VENTING: Examination._empty,
}
