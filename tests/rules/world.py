"""World of the search: the real instrument, a simple board, three peers on two buses, and abstract time.

The search covers the decisions of the instrument: arming, authorization, lease, faults, clearing, delayed
vent and stalls. The numbers are abstract: the measuring chain is replaced by its result (contact or not), all
times are multiples of 1/64 s, and the delay of a vent by a contact is 0.625 s instead of 5 s.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from copy import copy
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from pneuforce.instrument.core.controller import Instrument
from pneuforce.instrument.core.faults import HostFault
from pneuforce.instrument.core.reject_reason import RejectReason
from pneuforce.instrument.core.settings import Settings
from pneuforce.instrument.core.state import RequestedValues
from pneuforce.instrument.measurement.chain import Chain
from pneuforce.instrument.measurement.measurement import Measurement
from pneuforce.instrument.measurement.peak import PeakTracker
from pneuforce.instrument.measurement.zero import ZeroAdjustment
from pneuforce.instrument.rig.link import RawSample
from pneuforce.protocol.frames import BoardState, Fault, Mode, Sample, Valve
from pneuforce.protocol.limits import PRESSURISED

STEP_S = 1 / 64  #: time from one sample and tick to the next; exact in binary
WAIT_STEPS = 20  #: steps of one event "wait": longer than the silence that counts as a lost link
LEASE_S = DELAY_S = 2 * WAIT_STEPS * STEP_S
START_S = 1024.0

PLC, HMI, ROBOT = ("modbus_tcp", "10.0.0.1"), ("modbus_tcp", "10.0.0.2"), ("can", "")
PEERS = {"PLC": PLC, "HMI": HMI, "robot": ROBOT}
NAMES = {None: "", **{address: name for name, address in PEERS.items()}}

WRITES: dict[str, dict[str, Any]] = {
    "vent": {"mode": "vent"},
    "vent with a bad value": {"mode": "vent", "setpoint_requested_kpa": 1.0},
    "hold": {"mode": "hold", "setpoint_requested_kpa": 8.0},
    "lease": {"lease_s": LEASE_S},
    "end of lease": {"lease_s": 0.0},
    "clear": {"command_key": 0x5046, "command_code": "clear_faults", "command_sequence": 1},
}


class ChainResult(Chain):
    """Measuring chain that gives its result at once: each sample is valid, and a held balloon has a force."""

    contact = False

    def step(self, raw: RawSample) -> Measurement:
        """Return the measurement of a sample."""
        if raw.message.state != BoardState.HOLDING:
            return Measurement(raw.t_s, 0.0, 0.0)
        force_n = float(self.contact)
        return Measurement(
            raw.t_s, 8.0, 8.0, 8.0, 0.0, force_n=force_n, force_std_n=0.1, in_contact=self.contact
        )

    def proof_test_verdict(self, raw: RawSample) -> None:
        """Return None: the search contains no proof tests."""
        return


@dataclass
class Board:
    """Board that follows each command within one event "wait", unless `follows` is False."""

    state: BoardState = BoardState.VENTED
    cause: bool = False  #: the cause of a fault is present
    latched: bool = False
    follows: bool = True
    clear: int = 0

    def step(self, command: Any) -> None:
        """Apply a command."""
        if command.clear != self.clear:
            self.clear, self.latched = command.clear, False
        self.latched = self.latched or self.cause
        if self.latched:
            self.state = BoardState.TRIPPED
        elif self.follows and command.mode == Mode.VENT:
            self.state = BoardState.VENTED
        elif self.follows and self.state == BoardState.SETTLING:
            self.state = BoardState.HOLDING
        elif self.follows and self.state != BoardState.HOLDING:
            self.state = BoardState.SETTLING

    def sample(self) -> Sample:
        """Return the sample that the board sends now."""
        held = self.state in (BoardState.SETTLING, BoardState.HOLDING)
        return Sample(
            board_time_us=0,
            adc_sum=8000,
            supply_mv=5000,
            valves=Valve.VENT_CLOSED if held else Valve.NONE,
            state=self.state,
            fault=Fault.OVERPRESSURE if self.latched else 0,
            faults=(1 << Fault.OVERPRESSURE) if self.latched else 0,
            command=0,
            setpoint_pa=8000 if held else 0,
        )


class Seen(NamedTuple):
    """Values of the instrument that a peer or the board can see."""

    now_s: float
    commands_hold: bool  #: the command to the board is "hold"
    wants_hold: bool  #: the balloon shall be inflated
    vent_delayed: bool  #: the vent waits for the end of a contact
    in_contact: bool
    faults: frozenset[int]
    clearing: bool  #: a command to clear is in progress
    holder: str  #: name of the peer that holds the lease, or ""
    master_lost: bool
    age_s: float  #: age of the latest sample
    is_filled: bool  #: the latest sample shows an inflated balloon
    board_fault: bool  #: the latest sample shows a fault of the board
    force_valid: bool


class Change(NamedTuple):
    """One event, or one step of an event that lasts: what was seen before and after."""

    event: str
    peer: str  #: name of the peer that wrote, "" for the other events
    reason: RejectReason  #: reject reason of the write
    before: Seen
    after: Seen


@dataclass
class World:
    """Instrument and board at one instant. Each event returns the changes that it causes, step by step."""

    instrument: Instrument = field(default_factory=lambda: SearchedInstrument(SETTINGS))
    board: Board = field(default_factory=Board)
    now_s: float = START_S

    def apply(self, event: str, peer: str) -> list[Change]:
        """Carry out one event."""
        if peer:
            return [self._write(event, peer)]
        return EVENTS[event](self)

    def seen(self) -> Seen:
        """Return what can be seen now."""
        instrument, sample = self.instrument, self.instrument.sample
        return Seen(
            now_s=self.now_s,
            commands_hold=instrument.command().mode == Mode.HOLD,
            wants_hold=instrument.holding,
            vent_delayed=instrument.vent_pending,
            in_contact=instrument.measurement.in_contact,
            faults=frozenset(instrument.faults),
            clearing=instrument.clearing.pending,
            holder=NAMES[instrument.lease.holder],
            master_lost=instrument.master_lost,
            age_s=instrument.age_s(self.now_s),
            is_filled=sample is not None and sample.state in PRESSURISED,
            board_fault=sample is not None and bool(sample.faults),
            force_valid=math.isfinite(instrument.snapshot(PLC, self.now_s).force_n),
        )

    def _write(self, event: str, peer: str) -> Change:
        before = self.seen()
        reason = self.instrument.write(PEERS[peer], WRITES[event], self.now_s)
        return Change(event, peer, reason, before, self.seen())

    def _change(self, event: str, *actions: Callable[[], object]) -> list[Change]:
        changes, before = [], self.seen()
        for action in actions:
            action()
            after = self.seen()
            changes.append(Change(event, "", RejectReason.NONE, before, after))
            before = after
        return changes

    def _step(self, samples: bool) -> None:
        self.now_s += STEP_S
        if samples:
            self.board.step(self.instrument.command())
            self.instrument.process(RawSample(0, self.now_s, self.board.sample(), STEP_S))
        self.instrument.tick(self.now_s)

    def pass_time(self, event: str, samples: bool) -> list[Change]:
        """Let time pass, with or without samples from the board."""
        return self._change(event, *[lambda: self._step(samples)] * WAIT_STEPS)

    def stall(self) -> list[Change]:
        """Let time pass while the process of the instrument does not run."""

        def resume() -> None:
            self.now_s += WAIT_STEPS * STEP_S
            self.instrument.tick(self.now_s)

        return self._change("stall", resume)

    def touch(self) -> list[Change]:
        """Begin or end a contact. The next sample shows it."""
        chain = self.instrument.chain
        return self._change("touch", lambda: setattr(chain, "contact", not chain.contact))

    def break_or_repair(self) -> list[Change]:
        """Cause a fault of the board, or remove its cause."""
        return self._change("cause", lambda: setattr(self.board, "cause", not self.board.cause))

    def ignore_commands(self) -> list[Change]:
        """Let the board ignore all commands from now on, or follow them again."""
        return self._change("ignore", lambda: setattr(self.board, "follows", not self.board.follows))

    def restart_board(self) -> list[Change]:
        """Restart the board: it is vented, and its faults are forgotten."""
        self.board = Board(cause=self.board.cause, clear=self.instrument.command().clear)
        return self._change("restart of the board", self.instrument.board_restarted)

    def unplug(self) -> list[Change]:
        """Pull the serial cable and plug it in again."""
        return self._change("unplug", self.instrument.disconnected)

    def lose_master(self) -> list[Change]:
        """Lose the heartbeat of the CANopen master, or find it again."""
        instrument = self.instrument

        def lose() -> None:
            instrument.master_lost = True
            instrument.trip_after_contact(HostFault.CAN_MASTER_LOST, self.now_s)

        def find() -> None:
            instrument.master_lost = False

        return self._change("master", find if instrument.master_lost else lose)


EVENTS: dict[str, Callable[[World], list[Change]]] = {
    "wait": lambda world: world.pass_time("wait", samples=True),
    "silence": lambda world: world.pass_time("silence", samples=False),
    "stall": World.stall,
    "touch": World.touch,
    "cause": World.break_or_repair,
    "ignore": World.ignore_commands,
    "restart of the board": World.restart_board,
    "unplug": World.unplug,
    "master": World.lose_master,
}


SETTINGS = Settings(proof_test_s=0.0)
CHAIN = ChainResult(SETTINGS.chain, zero=ZeroAdjustment(zero_kpa=0.0))


class SearchedInstrument(Instrument):
    """Instrument without proof tests, whose measuring chain is replaced."""

    def __post_init__(self) -> None:
        self.chain = copy(CHAIN)  # a new chain would take 5 ms
        self.requested = RequestedValues()
        self.peaks = PeakTracker(0.06)
        self.balloon_id = 0
