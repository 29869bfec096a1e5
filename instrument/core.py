"""The instrument: one latest measurement, one state, one way to stop. No I/O; time is an argument."""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from instrument.arming import STEPS, Arming, Step
from instrument.chain import Chain, ChainSettings
from instrument.commands import CommandBlock
from instrument.faults import HostFault, Latch, codes_of
from instrument.interlocks import Limits, violated
from instrument.lease import Lease, Peer
from instrument.measurement import Measurement
from instrument.operations import Operations
from instrument.refusal import Refusal
from instrument.requests import Peers, Situation, Wanted, verdict
from instrument.rig.frames import (
    BoardState,
    Command,
    CommandFlag,
    Hello,
    Mode,
    Sample,
    Valve,
)
from instrument.rig.link import RawSample
from instrument.snapshot import Snapshot, snapshot_of

log = logging.getLogger("pneuforce")

LOST_S = 0.25
VENTED_KPA = 0.3
VENTED_S = 0.5
FROZEN_FRAMES = 10
CONTACT_GRACE_S = 5.0  #: how long a contact may put off the vent after a lease has run out
OBEY_S = 1.0  #: how long the board may take to leave the vented state when told to hold


@dataclass(frozen=True, slots=True, kw_only=True)
class Identity:
    """Who this instrument is."""

    serial_number: int = 0
    calibration_date: int = 0
    configuration_hash: int = 0
    balloon_id: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """What the core needs of the configuration."""

    chain: ChainSettings = field(default_factory=ChainSettings)
    limits: Limits = field(default_factory=Limits)
    identity: Identity = field(default_factory=Identity)
    force_limit_n: float = 5.0
    vent_on_force_limit: bool = False
    vent_after_s: float = 2.0
    write_lock: bool = False
    lease_demanded: bool = False


class Instrument:
    """Takes samples and requests, wants a command of the board, and can be looked at."""

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self.chain = Chain(settings.chain)
        self.measurement = Measurement(t_s=-math.inf)
        self.sample: Sample | None = None
        self.hello: Hello | None = None
        self.sample_counter = 0
        self.arming = Arming.CLEARED
        self.faults = Latch()
        self.lease = Lease()
        self.peers = Peers()
        self.wanted = Wanted(force_limit_n=settings.force_limit_n)
        self.operations = Operations(self)
        self.commands = CommandBlock(self.operations.table)
        self.can_down = False
        self.vented = False
        self.peak_force_n = math.nan
        self.balloon_id = settings.identity.balloon_id
        self.inflations = 0
        self._peak_n = math.nan
        self._finished_contacts = 0
        self._low_s = 0.0
        self._held_s = math.inf
        self._vent_due_s: float | None = None
        self._held_setpoint_kpa = math.nan
        self._board_time_us = 0
        self._told: object = None

    # ---- from the rig

    def greeted(self, hello: Hello) -> None:
        """A board of our protocol version answered."""
        self.hello = hello

    def board_restarted(self) -> None:
        """The board came back with less uptime than it must have: SAFE, and nothing is restored."""
        self.trip(HostFault.BOARD_RESET)

    def take(self, raw: RawSample, frozen_frames: int = 0) -> Measurement:
        """Use one sample: measure, look at the interlocks, follow the board."""
        message = raw.message
        dt_s = min(((message.board_time_us - self._board_time_us) & 0xFFFF_FFFF) * 1e-6, LOST_S)
        self._board_time_us = message.board_time_us
        self.sample = message
        self.sample_counter += 1
        m = self.measurement = self.chain.step(raw)
        self._verify_vented(message, m, dt_s)
        self._follow_board(message, raw.received_s)
        fault = violated(message, m, self.settings.limits)
        if fault is not None:
            self.trip(fault)
        if frozen_frames >= FROZEN_FRAMES:
            self.trip(HostFault.SENSOR_STUCK)
        if not self.chain.zero.taken and self.chain.zero.take():
            log.info("zero taken: the sensor reads %.3f kPa when vented", self.chain.zero.zero_kpa)
        self._follow_contact(m)
        return m

    def _verify_vented(self, sample: Sample, m: Measurement, dt_s: float) -> None:
        if not self.chain.zero.taken:
            self.vented = sample.state == BoardState.VENTED
            return
        low = sample.valves == Valve.NONE and -VENTED_KPA <= m.pressure_kpa <= VENTED_KPA
        self._low_s = self._low_s + dt_s if low else 0.0
        self.vented = self._low_s >= VENTED_S

    def _follow_board(self, sample: Sample, now_s: float) -> None:
        if not self.operations.clearing:
            for code in codes_of(sample.faults):
                self.trip(code)
        if sample.state in (BoardState.BOOT, BoardState.VENTED, BoardState.VENTING, BoardState.TRIPPED):
            if self.arming is Arming.HOLDING and not now_s <= self._held_s + OBEY_S:
                self.trip(HostFault.DISAGREEMENT)
        elif self.arming is Arming.HOLDING:
            self._held_s = now_s

    def _follow_contact(self, m: Measurement) -> None:
        if self.chain.tracker.finished != self._finished_contacts:
            self._finished_contacts = self.chain.tracker.finished
            self.peak_force_n, self._peak_n = self._peak_n, math.nan
        if m.in_contact and math.isfinite(m.force_n) and not m.force_n <= self._peak_n:
            self._peak_n = m.force_n
        if self.settings.vent_on_force_limit and self.force_limit_passed:
            self._vent()

    @property
    def tripped(self) -> bool:
        """Whether a fault has stopped the rig; not yet while a vent waits for the contact to end."""
        return self.arming is Arming.TRIPPED and self._vent_due_s is None

    @property
    def force_limit_passed(self) -> bool:
        """Whether the force, or a rise beyond any force worth measuring, calls for an alarm."""
        return self.measurement.force_n > self.wanted.force_limit_n or self.measurement.rise_kpa > 6.0

    # ---- time

    def tick(self, now_s: float) -> None:
        """What happens by time alone: silence, leases, vents put off, answers that did not come."""
        if self.link_lost(now_s) and self.sample is not None:
            self.trip(HostFault.LINK_LOST)
        if self.lease.ran_out(now_s):
            if self.arming is Arming.HOLDING and self.measurement.in_contact:
                self._vent_due_s = now_s + CONTACT_GRACE_S
            self.trip(HostFault.LEASE_EXPIRED)
        if self._vent_due_s is not None and not (
            self.measurement.in_contact and now_s <= self._vent_due_s and len(self.faults) == 1
        ):
            self._vent_due_s = None
        finished = self.operations.finished(now_s)
        if finished is not None:
            self.commands.finish(finished)

    def age_s(self, now_s: float) -> float:
        """Age of the latest sample [s], never negative."""
        return max(0.0, now_s - self.measurement.t_s)

    def link_lost(self, now_s: float) -> bool:
        """Whether no frame has come for more than 250 ms."""
        return not self.age_s(now_s) <= LOST_S

    # ---- to the rig

    def command(self) -> Command:
        """What the board should do now."""
        hold = self.arming is Arming.HOLDING or self._vent_due_s is not None
        zero = self.chain.zero
        flags = CommandFlag.IN_CONTACT if self.measurement.in_contact else CommandFlag.NONE
        if zero.taken:
            flags |= CommandFlag.ZEROED
        return Command(
            mode=Mode.HOLD if hold else Mode.VENT,
            flags=flags,
            setpoint_pa=round(self._held_setpoint_kpa * 1e3) if hold else 0,
            zero_pa=round(zero.zero_kpa * 1e3) if zero.taken else 0,
            contact_limit_pa=round(self.settings.limits.contact_kpa * 1e3),
            vent_after_ms=round(self.settings.vent_after_s * 1e3),
            clear=self.operations.clear_count & 0xFF,
        )

    def trip(self, fault: int) -> None:
        """Latch a fault and stop holding: the one way to stop."""
        if self.faults.set(fault):
            log.warning("tripped: fault %d", fault)
        self.step(Step.TRIP)

    def step(self, step: Step) -> None:
        """Go one step of the arming table."""
        self.arming = STEPS[self.arming][step]
        self.wanted.mode = "hold" if self.arming is Arming.HOLDING else "vent"

    # ---- to whoever asks

    def snapshot(self, peer: Peer, now_s: float) -> Snapshot:
        """Every quantity at one instant, as `peer` sees it."""
        return snapshot_of(self, peer, now_s)

    # ---- requests

    def write(self, peer: Peer, values: Mapping[str, Any], now_s: float) -> Refusal:
        """Carry out one request, all or nothing; only a vent is carried out whatever else is refused."""
        memory = self.peers.of(peer)
        refusal = verdict(peer, values, memory, self.wanted, self.lease, self._situation(now_s))
        if refusal is Refusal.NONE:
            self._carry_out(peer, values, now_s)
        elif values.get("mode") == "vent":
            self._vent()
        memory.refusal = refusal
        if "mode" in values:
            memory.mode = values["mode"]
        self._tell(peer, values, refusal)
        return refusal

    def _tell(self, peer: Peer, values: Mapping[str, Any], refusal: Refusal) -> None:
        """Log a write, but not its repetitions: a PLC may write the same every cycle."""
        told = (peer, dict(values), refusal)
        if told != self._told:
            self._told = told
            verdict_text = "done" if refusal is Refusal.NONE else f"refused, {refusal}"
            log.info("%s %s wrote %s: %s", *peer, dict(values), verdict_text)

    def _situation(self, now_s: float) -> Situation:
        return Situation(
            arming=self.arming,
            link_lost=self.link_lost(now_s),
            zeroed=self.chain.zero.taken,
            vented=self.vented,
            in_contact=self.measurement.in_contact,
            write_lock=self.settings.write_lock,
            lease_demanded=self.settings.lease_demanded,
        )

    def _carry_out(self, peer: Peer, values: Mapping[str, Any], now_s: float) -> None:
        wanted = self.wanted
        wanted.setpoint_kpa = values.get("setpoint_requested_kpa", wanted.setpoint_kpa)
        wanted.force_limit_n = values.get("force_limit_n", wanted.force_limit_n)
        if "reference_pressure_kpa" in values:
            wanted.reference_kpa = self.chain.reference_kpa = values["reference_pressure_kpa"]
        if "lease_s" in values:
            self.lease.take(peer, values["lease_s"], now_s)
        self.lease.renew(peer, now_s)
        if values.get("mode") == "vent":
            self._vent()
        elif values.get("mode") == "hold":
            if self.arming is not Arming.HOLDING:
                self.inflations += 1
                self._held_s = now_s
            self.step(Step.HOLD)
        if self.arming is Arming.HOLDING:
            self._held_setpoint_kpa = wanted.setpoint_kpa
        if any(name.startswith("command_") for name in values):
            self.commands.write(values, now_s)

    def _vent(self) -> None:
        self._vent_due_s = None
        self.step(Step.VENT)
