"""A scenario played in virtual time by the least host that a board needs: no port, no process, no waiting."""

from __future__ import annotations

import math
from collections.abc import Iterator

from instrument.rig.frames import (
    SAMPLES_PER_S,
    BoardState,
    Command,
    CommandFlag,
    Decoder,
    Identify,
    Mode,
    Sample,
    encode,
)
from instrument.rig.limits import nominal_pressure_kpa
from sim.contacts.contact import Phase
from sim.hand import READY_S
from sim.membrane.family import Progress
from sim.rig import STEP_S, Truth
from sim.scenario import Scenario
from sim.staging import world_of

COMMAND_STEPS = SAMPLES_PER_S // 20  #: a command each 50 ms
ZERO_SAMPLES = SAMPLES_PER_S  #: the mean of one second is the sensor's zero
#: What a phase takes beside its contacts: filling, settling, and the hand's own waiting.
START_S, FILL_KPA_PER_S, SETTLE_S = 2.0, 4.5, 1.2
TRIPPED_S = 1.0  #: a board that has tripped is watched for this long
#: A scenario whose board never holds, or that nobody hears, is given up when this much more has passed.
PATIENCE_S = 60.0


class Playback:
    """Iterates over the bytes that come from the board, 2 ms each.

    It ends when all phases are `finished`, when the board has `tripped`, or when neither will come.
    """

    def __init__(self, scenario: Scenario, progress: Progress = lambda _done, _total: None) -> None:
        """`progress(done, total)` hears how the table of a new membrane grows."""
        self.expected_s = _expected_s(scenario.phases)  #: about how long it will take, in virtual time
        self.tripped = False  #: whether the board did
        self._world = world_of(scenario, again=False, progress=progress)
        self._steps = 0
        self._decoder = Decoder.of_board()
        self._sequence = 0
        self._heard = False  # whether a sample has come
        self._zero: list[float] = []  # pressures [kPa] that the vented sensor reads
        self._trips_left_s = TRIPPED_S

    @property
    def now_s(self) -> float:
        """Virtual time since the board was switched on [s]."""
        return self._steps * STEP_S

    @property
    def finished(self) -> bool:
        """Whether all phases have been played."""
        return self._world.rig.hand.finished

    @property
    def truth(self) -> Truth:
        """The truth behind the bytes that came last."""
        return self._world.rig.truth

    def __iter__(self) -> Iterator[bytes]:
        while not self._ended:
            sent = self._world.step(self._told())
            self._steps += 1
            self._hear(sent)
            yield sent

    @property
    def _ended(self) -> bool:
        late = self.now_s > 2 * self.expected_s + PATIENCE_S
        return self.finished or self._trips_left_s <= 0 or late

    def _told(self) -> bytes:
        """What the host sends: greetings until it is heard, then what it wants, again and again."""
        if self._steps % COMMAND_STEPS:
            return b""
        self._sequence += 1
        return encode(self._wanted() if self._heard else Identify(), self._sequence)

    def _wanted(self) -> Command:
        if len(self._zero) < ZERO_SAMPLES or self.tripped:
            return Command(Mode.VENT)
        setpoint_pa = round(self._world.rig.hand.setpoint_kpa * 1e3)
        zero_pa = round(math.fsum(self._zero) / len(self._zero) * 1e3)
        return Command(Mode.HOLD, CommandFlag.ZEROED, setpoint_pa, zero_pa)

    def _hear(self, sent: bytes) -> None:
        for frame in self._decoder.feed(sent):
            if isinstance(frame.message, Sample):
                self._follow(frame.message)

    def _follow(self, sample: Sample) -> None:
        self._heard = True
        if sample.state == BoardState.VENTED and len(self._zero) < ZERO_SAMPLES:
            self._zero.append(nominal_pressure_kpa(sample.adc_sum))
        if sample.state == BoardState.TRIPPED:
            self.tripped = True
            self._trips_left_s -= STEP_S


def _expected_s(phases: tuple[Phase, ...]) -> float:
    expected_s, before_kpa = START_S, 0.0
    for phase in phases:
        way_kpa = abs(phase.setpoint_kpa - before_kpa)
        before_kpa = phase.setpoint_kpa
        expected_s += way_kpa / FILL_KPA_PER_S + SETTLE_S + READY_S
        expected_s += sum(contact.lasts_s for contact in phase.contacts)
    return expected_s
