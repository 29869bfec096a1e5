"""The instrument: one latest measurement, one state, one way to stop. No I/O; time is an argument."""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping
from typing import Any

from instrument.arming import STEPS, Arming, Step
from instrument.chain import Chain
from instrument.commands import CommandBlock
from instrument.execution import carry_out, situation_of, tell
from instrument.faults import HostFault, Latch, codes_of, name_of
from instrument.interlocks import InterlockWatch
from instrument.lease import Lease, Peer
from instrument.measurement import Measurement
from instrument.obedience import Obedience
from instrument.operations import Operations
from instrument.refusal import Refusal
from instrument.requests import Peers, Wanted, verdict
from instrument.rig.frames import Command, CommandFlag, Hello, Mode, Sample
from instrument.rig.limits import HOST_SILENCE_S
from instrument.rig.link import RawSample
from instrument.settings import Settings
from instrument.snapshot import Snapshot, snapshot_of
from instrument.vented import VentedWatch

log = logging.getLogger("pneuforce")

CONTACT_GRACE_S = 5.0  #: how long a contact may put off the vent where nobody commands any more
ALARM_RISE_KPA = 6.0  #: a rise beyond any force worth measuring


class Instrument:
    """Takes samples and requests, wants a command of the board, and can be looked at."""

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self.chain = Chain(settings.chain)
        self.measurement = Measurement(t_s=-math.inf)
        self.raw: RawSample | None = None
        self.hello: Hello | None = None
        self.sample_counter = 0
        self.arming = Arming.CLEARED
        self.faults = Latch()
        self.lease = Lease()
        self.peers = Peers()
        self.wanted = Wanted(force_limit_n=settings.force_limit_n)
        self.operations = Operations(self)
        self._blocks: dict[str, CommandBlock] = {}
        self.can_down = False
        self.master_lost = False  #: the CAN master's heartbeat is watched, and stays away
        self.log_down = False  #: events cannot be kept just now
        self.recording_down = False  #: a recording that was asked for has stopped by itself
        self.peak_force_n = math.nan
        self.balloon_id = settings.identity.balloon_id
        self.inflations = 0
        self._peak_n = math.nan
        self._finished_contacts = 0
        self._obedience = Obedience()
        self._vented = VentedWatch()
        self._interlocks = InterlockWatch()
        self._vent_due_s: float | None = None
        self.held_setpoint_kpa = math.nan
        self._views: dict[tuple[float, str, Refusal], Snapshot] = {}  # of one instant, until anything changes

    # ---- from the rig

    def greeted(self, hello: Hello) -> None:
        """A board of our protocol version answered; another one than before has another sensor."""
        self._views = {}
        if self.hello is not None and hello.serial != self.hello.serial:
            self.chain.zero.forget()
            self.trip(HostFault.BOARD_RESET)
        self.hello = hello

    def board_restarted(self) -> None:
        """The board came back with less uptime than it must have: SAFE, and nothing is restored."""
        self.trip(HostFault.BOARD_RESET)

    def disconnected(self) -> None:
        """The port is gone: what was held is held no longer, though samples may be back within a moment."""
        if self.raw is not None:
            self.trip(HostFault.LINK_LOST)

    @property
    def sample(self) -> Sample | None:
        """The board's latest message."""
        return self.raw.message if self.raw else None

    def take(self, raw: RawSample) -> Measurement:
        """Use one sample: measure, look at the interlocks, follow the board."""
        self._views = {}
        message = raw.message
        m = self.chain.step(raw)
        self.raw, self.measurement = raw, m
        self.sample_counter += 1
        self._vented.step(raw, m.pressure_kpa, self.chain.zero.taken)
        self._follow_board(message, raw.t_s)
        fault = self._interlocks.step(raw, m, self.settings.contact_limit_kpa)
        if fault is not None:
            self.trip(fault)
        if not self.chain.zero.taken and self.chain.zero.take():
            log.info("zero taken: the sensor reads %.3f kPa when vented", self.chain.zero.zero_kpa)
        self._follow_contact(m)
        return m

    def _follow_board(self, sample: Sample, now_s: float) -> None:
        for code in codes_of(sample.faults):
            if code not in self.operations.clearing:
                self.trip(code)
        if not self._obedience.follow(sample.state, self.holding, now_s):
            self.trip(HostFault.DISAGREEMENT if self.holding else HostFault.NOT_VENTED)

    def _follow_contact(self, m: Measurement) -> None:
        if self.chain.tracker.finished != self._finished_contacts:
            self._finished_contacts = self.chain.tracker.finished
            self.peak_force_n, self._peak_n = self._peak_n, math.nan
        if m.in_contact and math.isfinite(m.force_n) and not m.force_n <= self._peak_n:
            self._peak_n = m.force_n
        if self.settings.vent_on_force_limit and self.holding and self.force_limit_passed:
            self.trip(HostFault.FORCE_LIMIT)

    def vented(self, now_s: float) -> bool:
        """Whether samples verify that the balloon is vented, and go on doing so."""
        return self._vented.vented and not self.link_lost(now_s)

    @property
    def tripped(self) -> bool:
        """Whether a fault has stopped the rig; not yet while a vent waits for the contact to end."""
        return self.arming is Arming.TRIPPED and not self.vent_pending

    @property
    def vent_pending(self) -> bool:
        """Whether nobody commands any more and the vent waits for the contact to end."""
        return self._vent_due_s is not None

    @property
    def holding(self) -> bool:
        """Whether the balloon is meant to be inflated now."""
        return self.arming is Arming.HOLDING or self.vent_pending

    @property
    def force_limit_passed(self) -> bool:
        """Whether the force calls for an alarm, or the pressure as sampled, which does not lag behind."""
        m = self.measurement
        return (
            m.force_uncompensated_n > self.wanted.force_limit_n
            or m.unfiltered_kpa - m.initial_kpa > ALARM_RISE_KPA
        )

    # ---- time

    def tick(self, now_s: float) -> None:
        """What happens by time alone: silence, leases, vents put off, answers that did not come."""
        self._views = {}
        if self.link_lost(now_s) and self.sample is not None:
            self.trip(HostFault.LINK_LOST)
        self._watch_lease(now_s)
        self._obedience.tell(self.holding, now_s)
        if self._vent_due_s is not None and not (self.measurement.in_contact and now_s <= self._vent_due_s):
            self._vent_due_s = None
        finished = self.operations.finished(now_s)
        if finished is not None:
            for block in self._blocks.values():
                block.finish(finished)

    def _watch_lease(self, now_s: float) -> None:
        if self.lease.ran_out(now_s):
            self.abandoned(HostFault.LEASE_EXPIRED, now_s)

    def abandoned(self, fault: int, now_s: float) -> None:
        """Trip because nobody commands any more; in contact the vent waits for its end, at most 5 s."""
        pressed = self.arming is Arming.HOLDING and self.measurement.in_contact
        due_s = now_s + CONTACT_GRACE_S if pressed else self._vent_due_s
        self.trip(fault)
        self._vent_due_s = due_s

    def age_s(self, now_s: float) -> float:
        """Age of the latest sample [s], never negative."""
        return max(0.0, now_s - self.measurement.t_s)

    def link_lost(self, now_s: float) -> bool:
        """Whether no frame has come for more than 250 ms."""
        return not self.age_s(now_s) <= HOST_SILENCE_S

    # ---- to the rig

    def command(self) -> Command:
        """What the board should do now."""
        hold = self.holding and not self._obedience.vent_owed
        zero = self.chain.zero
        flags = CommandFlag.IN_CONTACT if self.measurement.in_contact else CommandFlag.NONE
        if zero.taken:
            flags |= CommandFlag.ZEROED
        return Command(
            mode=Mode.HOLD if hold else Mode.VENT,
            flags=flags,
            setpoint_pa=round(self.held_setpoint_kpa * 1e3) if hold else 0,
            zero_pa=round(zero.zero_kpa * 1e3) if zero.taken else 0,
            contact_limit_pa=round(self.settings.contact_limit_kpa * 1e3),
            vent_after_ms=round(self.settings.vent_after_s * 1e3),
            clear=self.operations.clear_count & 0xFF,
        )

    def trip(self, fault: int) -> None:
        """Latch a fault and stop holding, at once: the one way to stop."""
        new = self.faults.set(fault)
        self.operations.clearing.discard(fault)
        self._vent_due_s = None
        self.advance(Step.TRIP)
        if new:
            log.warning("tripped: %s (fault %d)", name_of(fault), fault)

    def vent(self, now_s: float) -> None:
        """Vent: carried out whatever the state, and told to the board even if "hold" follows at once."""
        if self.holding:
            self._obedience.ask_vent(now_s)
        self._vent_due_s = None
        self.advance(Step.VENT)

    def hold(self) -> None:
        """Inflate to the setpoint, then lock; to be asked only where arming allows it."""
        if self.arming is not Arming.HOLDING:
            self.inflations += 1
            self._obedience.ask_hold()
        self.advance(Step.HOLD)

    def advance(self, step: Step) -> None:
        """Go one step of the arming table."""
        self._views = {}
        self.arming = STEPS[self.arming][step]
        self.wanted.mode = "hold" if self.arming is Arming.HOLDING else "vent"

    # ---- to whoever asks

    def commands(self, peer: Peer) -> CommandBlock:
        """The command block of the peer's channel: each bus counts its own sequence numbers."""
        return self._blocks.setdefault(peer[0], CommandBlock(self.operations))

    def __getstate__(self) -> dict[str, Any]:
        """All but the snapshots of the present instant."""
        return vars(self) | {"_views": {}}

    def snapshot(self, peer: Peer, now_s: float) -> Snapshot:
        """Every quantity at one instant, as `peer` sees it; at that instant one for all who see alike."""
        view = (now_s, peer[0], self.peers.refusal_of(peer))
        if view not in self._views:
            self._views = {view: snapshot_of(self, peer, now_s)}
        return self._views[view]

    # ---- requests

    def write(self, peer: Peer, values: Mapping[str, Any], now_s: float) -> Refusal:
        """Carry out one request, all or nothing; only a vent is carried out whatever else is refused."""
        self._views = {}
        self._watch_lease(now_s)
        memory = self.peers.of(peer)
        refusal = verdict(peer, values, memory, self.wanted, self.lease, situation_of(self, peer, now_s))
        if refusal is Refusal.NONE:
            carry_out(self, peer, values, now_s)
        elif values.get("mode") == "vent":
            self.vent(now_s)
        memory.refusal = refusal
        if "mode" in values:
            memory.mode = values["mode"]
        tell(peer, values, refusal, memory)
        return refusal
