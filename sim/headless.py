"""Playback of a scenario by a minimal host in virtual time, without a port, a process or waiting."""

from __future__ import annotations

import math
from collections.abc import Iterator

from pneuforce.protocol.frames import (
    SAMPLES_PER_S,
    BoardState,
    Command,
    CommandFlag,
    FrameDecoder,
    Identify,
    Mode,
    Sample,
    encode,
)
from pneuforce.protocol.limits import nominal_pressure_kpa
from pneuforce.sim.contacts.contact import Phase
from pneuforce.sim.factory import build_world
from pneuforce.sim.hand import READY_S
from pneuforce.sim.plants.membrane.table import ProgressCallback
from pneuforce.sim.rig import STEP_S, Truth
from pneuforce.sim.scenario import Scenario

COMMAND_STEPS = SAMPLES_PER_S // 20  #: the host sends a command every 50 ms
ZERO_SAMPLES = SAMPLES_PER_S  #: the zero of the sensor is the mean of one second
#: Values for an estimate of the time before the contacts: start of the rig [s], filling rate [kPa/s], and
#: settling time [s].
START_S, FILL_KPA_PER_S, SETTLE_S = 2.0, 4.5, 1.2
TRIPPED_S = 1.0  #: the playback continues for this time after the board has tripped
#: The playback ends after twice the expected time plus this time [s], for example if the board never reaches
#: the setpoint.
MAX_DELAY_S = 60.0


class Playback:
    """Iterable over the bytes that the board sends. Each item contains the bytes of 2 ms.

    The playback ends after all phases, after a trip of the board, or if the playback takes too long.
    """

    def __init__(self, scenario: Scenario, progress: ProgressCallback = lambda _done, _total: None) -> None:
        """Build the rig.

        `progress(done, total)` is called while the table of a new membrane balloon is computed.
        """
        self.expected_s = _expected_s(scenario.phases)  #: approximate duration in virtual time
        self.tripped = False  #: True if the board has tripped
        self._world = build_world(scenario, repeat=False, progress=progress)
        self._steps = 0
        self._decoder = FrameDecoder.for_board_frames()
        self._sequence = 0
        self._received_sample = False
        self._zero: list[float] = []  # pressures [kPa] that the vented sensor reads
        self._tripped_remaining_s = TRIPPED_S

    @property
    def now_s(self) -> float:
        """Return the virtual time since the board was switched on [s]."""
        return self._steps * STEP_S

    @property
    def finished(self) -> bool:
        """Return True if all phases have been played."""
        return self._world.rig.hand.finished

    @property
    def truth(self) -> Truth:
        """Return the true state of the rig at the time of the last returned bytes."""
        return self._world.rig.truth

    def __iter__(self) -> Iterator[bytes]:
        while not self._ended:
            from_board = self._world.step(self._from_host())
            self._steps += 1
            self._receive(from_board)
            yield from_board

    @property
    def _ended(self) -> bool:
        late = self.now_s > 2 * self.expected_s + MAX_DELAY_S
        return self.finished or self._tripped_remaining_s <= 0 or late

    def _from_host(self) -> bytes:
        """Return the bytes of the host: Identify until the first sample arrives, then commands."""
        if self._steps % COMMAND_STEPS:
            return b""
        self._sequence += 1
        return encode(self._command() if self._received_sample else Identify(), self._sequence)

    def _command(self) -> Command:
        if len(self._zero) < ZERO_SAMPLES or self.tripped:
            return Command(Mode.VENT)
        setpoint_pa = round(self._world.rig.hand.setpoint_kpa * 1e3)
        zero_pa = round(math.fsum(self._zero) / len(self._zero) * 1e3)
        return Command(Mode.HOLD, CommandFlag.ZEROED, setpoint_pa, zero_pa)

    def _receive(self, from_board: bytes) -> None:
        for frame in self._decoder.feed(from_board):
            if isinstance(frame.message, Sample):
                self._process(frame.message)

    def _process(self, sample: Sample) -> None:
        self._received_sample = True
        if sample.state == BoardState.VENTED and len(self._zero) < ZERO_SAMPLES:
            self._zero.append(nominal_pressure_kpa(sample.adc_sum))
        if sample.state == BoardState.TRIPPED:
            self.tripped = True
            self._tripped_remaining_s -= STEP_S


def _expected_s(phases: tuple[Phase, ...]) -> float:
    expected_s, before_kpa = START_S, 0.0
    for phase in phases:
        change_kpa = abs(phase.setpoint_kpa - before_kpa)
        before_kpa = phase.setpoint_kpa
        expected_s += change_kpa / FILL_KPA_PER_S + SETTLE_S + READY_S
        expected_s += sum(contact.duration_s for contact in phase.contacts)
    return expected_s
