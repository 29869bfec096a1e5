"""State of the instrument: data, derived properties and transitions."""

from __future__ import annotations

import logging
import math
from collections.abc import Hashable
from dataclasses import dataclass, field

from pneuforce.instrument.core.arming import STEPS, Arming, Step
from pneuforce.instrument.core.command_monitor import CommandMonitor
from pneuforce.instrument.core.event_log_head import EventLogHead
from pneuforce.instrument.core.faults import FaultLatch, described
from pneuforce.instrument.core.force_alarm import ForceAlarm
from pneuforce.instrument.core.lease import Lease
from pneuforce.instrument.core.peers import Peers
from pneuforce.instrument.core.proof_test_schedule import ProofTestSchedule
from pneuforce.instrument.core.settings import Settings
from pneuforce.instrument.core.stall_monitor import StallMonitor
from pneuforce.instrument.core.vent_monitor import VentMonitor
from pneuforce.instrument.measurement.chain import Chain
from pneuforce.instrument.measurement.force_extremes import ForceExtremes
from pneuforce.instrument.measurement.measurement import Measurement, Quality
from pneuforce.instrument.measurement.peak import PeakTracker
from pneuforce.instrument.rig.firmware import Firmware
from pneuforce.instrument.rig.link import RawSample
from pneuforce.protocol.frames import Fault, Hello, Sample
from pneuforce.protocol.limits import HOST_SILENCE_S

#: Logger for trips and state changes. The log never drops its lines because of other lines.
STATE_LOGGER = "pneuforce.state"
log = logging.getLogger(STATE_LOGGER)

MAX_VENT_DELAY_S = 5.0  #: longest time that a contact delays the vent after the commanding peer is lost
#: Status bits of the faults after which the pressure does not prove an empty balloon.
_DOUBTFUL_VENT = frozenset({"sensor_fault", "vent_fault"})


@dataclass(slots=True)
class RequestedValues:
    """Last accepted value of each quantity that a peer can request."""

    setpoint_kpa: float = math.nan
    force_limit_n: float = 5.0
    force_limit_2_n: float = 10.0
    alarm_hysteresis_n: float = 0.1
    alarm_delay_s: float = 0.0
    mode: str = "vent"
    reference_kpa: float = 0.0
    reference_written_s: float = -math.inf  #: time of the last write of `reference_kpa`
    ambient_kpa: float = math.nan
    ambient_written_s: float = -math.inf  #: time of the last write of `ambient_kpa`


@dataclass(slots=True)
class FaultClearing:
    """Progress of the command that clears the faults of the host and of the board."""

    count: int = 0  #: counter that is sent to the board: a change clears the faults of the board
    #: Faults that are being cleared: a report of the board does not latch them again. A fault that the host
    #: detects again is removed from this set, so that it stays latched.
    faults: set[int] = field(default_factory=set)
    since_s: float | None = None  #: start of the command; None if no command is in progress

    @property
    def pending(self) -> bool:
        """Return True while the instrument waits for the board to clear its faults."""
        return self.since_s is not None


@dataclass(eq=False, repr=False)
class InstrumentState:
    """Data of the instrument and the transitions between its states. No I/O; time is an argument."""

    settings: Settings
    chain: Chain = field(init=False)
    measurement: Measurement = field(default_factory=lambda: Measurement(t_s=-math.inf))
    raw: RawSample | None = None
    hello: Hello | None = None
    firmware: Firmware | None = None  #: None until the board has completed the handshake
    sample_counter: int = 0
    arming: Arming = Arming.CLEARED
    faults: FaultLatch = field(default_factory=FaultLatch)
    clearing: FaultClearing = field(default_factory=FaultClearing)
    lease: Lease = field(default_factory=Lease)
    peers: Peers = field(default_factory=Peers)
    requested: RequestedValues = field(init=False)
    alarm_2: ForceAlarm = field(default_factory=ForceAlarm)
    held_setpoint_kpa: float = math.nan
    can_down: bool = False
    master_lost: bool = False  #: the heartbeat of the CANopen master is monitored and missing
    log_down: bool = False  #: the event log cannot be written
    #: Head of the event log, and UTC minus the monotonic clock [s]. Only shown, and unknown in a replay.
    event_log_head: EventLogHead = field(default=EventLogHead(), metadata={"state": False})
    utc_offset_s: float = field(default=math.nan, metadata={"state": False})
    recording_down: bool = False  #: a requested recording has stopped because of an error
    certificate_expiring: bool = False  #: a certificate of a server expires soon
    peak_force_n: float = math.nan  #: force of the last completed peak
    peaks: PeakTracker = field(init=False)
    extremes: ForceExtremes = field(default_factory=ForceExtremes)
    balloon_id: int = field(init=False)
    inflation_count: int = 0
    revision: int = 0  #: grows with each change; snapshots are cached per revision
    vent_due_s: float | None = None
    command_monitor: CommandMonitor = field(default_factory=CommandMonitor)
    vent_monitor: VentMonitor = field(default_factory=VentMonitor)
    proof_tests: ProofTestSchedule = field(default_factory=ProofTestSchedule)
    stalls: StallMonitor = field(default_factory=StallMonitor)

    def __post_init__(self) -> None:
        self.chain = Chain(self.settings.chain)
        self.peaks = PeakTracker(self.settings.chain.tube_time_constant_s)
        self.requested = RequestedValues(
            force_limit_n=self.settings.force_limit_n,
            force_limit_2_n=self.settings.force_limit_2_n,
            alarm_hysteresis_n=self.settings.alarm_hysteresis_n,
            alarm_delay_s=self.settings.alarm_delay_s,
        )
        self.balloon_id = self.settings.identity.balloon_id

    # ---- derived properties

    @property
    def sample(self) -> Sample | None:
        """Return the latest message of the board, or None before the first message."""
        return self.raw.message if self.raw else None

    def vented(self, now_s: float) -> bool:
        """Return True if recent samples prove that the balloon is vented."""
        return self.vent_monitor.vented and not self.link_lost(now_s)

    @property
    def vent_doubtful(self) -> bool:
        """Return True if a latched fault shows that the pressure does not prove an empty balloon."""
        return not self.faults.status.isdisjoint(_DOUBTFUL_VENT)

    @property
    def tripped(self) -> bool:
        """Return True if a fault is latched, and no vent waits for the end of a contact."""
        return self.arming is Arming.TRIPPED and not self.vent_pending

    @property
    def vent_pending(self) -> bool:
        """Return True if the commanding peer is lost and the vent waits for the end of the contact."""
        return self.vent_due_s is not None

    @property
    def holding(self) -> bool:
        """Return True if the balloon shall be inflated now."""
        return self.arming is Arming.HOLDING or self.vent_pending

    @property
    def alarm_force_n(self) -> float:
        """Return the force for the alarms [N]. It is infinite if the balloon may be pressed flat.

        The unfiltered pressure, which has no filter delay, also counts. A single outlier does not end the
        force, but it sets the alarm.
        """
        m = self.measurement
        is_high = m.unfiltered_kpa - m.baseline_kpa > self.chain.largest_rise_kpa
        return math.inf if is_high or Quality.FLAT in m.quality else m.force_uncompensated_n

    @property
    def force_limit_exceeded(self) -> bool:
        """Return True if the force for the alarms exceeds the first limit."""
        return self.alarm_force_n > self.requested.force_limit_n

    @property
    def firmware_allowed(self) -> bool:
        """Return True if the configuration allows an inflation with the firmware of the board."""
        is_released = self.firmware is not None and self.firmware.is_released
        return is_released or not self.settings.require_released_firmware

    def reference_known(self, now_s: float) -> bool:
        """Return True if the pressure around the balloon was written recently, or need not be written."""
        timeout_s = self.settings.reference_timeout_s
        return timeout_s == 0 or now_s - self.requested.reference_written_s <= timeout_s

    def recent_ambient_kpa(self, now_s: float) -> float:
        """Return the written ambient pressure [kPa], NaN if it was not written recently."""
        requested = self.requested
        is_recent = now_s - requested.ambient_written_s <= self.settings.ambient_timeout_s
        return requested.ambient_kpa if is_recent else math.nan

    @property
    def discrete_state(self) -> Hashable:
        """Return a value that changes if a sample changes a state, a fault or a flag.

        Conditions that depend on the time or on a slow drift are not included. They are checked at each tick.
        """
        m, sample = self.measurement, self.sample
        return (
            self.arming,
            len(self.faults),
            sample and (sample.state, sample.setpoint_pa),
            (m.in_contact, m.quality, math.isfinite(m.force_n + m.force_std_n)),
            self.force_limit_exceeded,
            self.alarm_2.active,
            self.vent_monitor.vented,
            self.chain.tracker.contact_count,
            self.peaks.count,
            self.chain.zero.taken,
            self.can_down,
        )

    @property
    def service_failures(self) -> tuple[bool, ...]:
        """Return the flags for parts of the host process that have failed or will fail.

        Other parts of the host process set these flags without a change of `revision`.
        """
        return self.can_down, self.log_down, self.recording_down, self.certificate_expiring

    def age_s(self, now_s: float) -> float:
        """Return the age of the latest sample [s]. It is never negative."""
        return max(0.0, now_s - self.measurement.t_s)

    def link_lost(self, now_s: float) -> bool:
        """Return True if no sample has arrived for more than 250 ms."""
        return not self.age_s(now_s) <= HOST_SILENCE_S

    # ---- transitions

    def advance(self, step: Step) -> None:
        """Apply one transition of the arming table."""
        self.revision += 1
        self.arming = STEPS[self.arming][step]
        self.requested.mode = "hold" if self.arming is Arming.HOLDING else "vent"

    def trip(self, fault: int) -> None:
        """Latch a fault and end the hold at once."""
        self._trip(fault, None)

    def trip_after_contact(self, fault: int, now_s: float) -> None:
        """Trip because the commanding peer is lost. A contact delays the vent, at most by 5 s."""
        in_contact = self.arming is Arming.HOLDING and self.measurement.in_contact
        due_s = now_s + MAX_VENT_DELAY_S if in_contact else self.vent_due_s
        self._trip(fault, due_s)

    def _trip(self, fault: int, vent_due_s: float | None) -> None:
        was_pending, is_new = self.vent_pending, self.faults.set(fault)
        self.clearing.faults.discard(fault)
        self.proof_tests.tube_unproven |= fault == Fault.OCCLUSION
        self.vent_due_s = vent_due_s
        self.advance(Step.TRIP)
        if is_new and self.vent_pending:
            log.warning(
                "%s: the rig vents and trips when the contact ends, at the latest after %g s",
                described(fault),
                MAX_VENT_DELAY_S,
            )
        elif is_new or (was_pending and not self.vent_pending):
            log.warning("tripped: %s", described(fault))

    def end_vent_delay(self) -> None:
        """Vent now if the vent waits for the end of a contact."""
        if self.vent_pending:
            self.vent_due_s = None
            log.warning("tripped: %s", described(self.faults.first))

    def vent(self, now_s: float) -> None:
        """Vent in any state. The board receives the vent even if a hold follows at once."""
        if self.holding:
            self.command_monitor.request_vent(now_s)
        self.end_vent_delay()
        self.advance(Step.VENT)

    def hold(self) -> None:
        """Inflate to the setpoint, then lock. Call this only in a state of arming that allows a hold."""
        if self.arming is not Arming.HOLDING:
            self.inflation_count += 1
            self.command_monitor.request_hold()
        self.advance(Step.HOLD)
