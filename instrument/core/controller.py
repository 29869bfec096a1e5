"""Instrument without I/O: computes snapshots and board commands from samples, requests and the time."""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from pneuforce.instrument.core.arming import Arming
from pneuforce.instrument.core.authorization import authorize
from pneuforce.instrument.core.faults import HostFault, codes_of
from pneuforce.instrument.core.interlocks import InterlockMonitor
from pneuforce.instrument.core.lease import Peer
from pneuforce.instrument.core.operations import finish_clearing
from pneuforce.instrument.core.proof_test_schedule import log_proof_test, oldest_forbidding_s
from pneuforce.instrument.core.reject_reason import RejectReason
from pneuforce.instrument.core.requests import execute, log_write, write_context_of
from pneuforce.instrument.core.snapshot import Snapshot, snapshot_of
from pneuforce.instrument.core.stall_monitor import StallReport
from pneuforce.instrument.core.state import InstrumentState
from pneuforce.instrument.measurement.measurement import Measurement, Quality
from pneuforce.instrument.rig.firmware import Firmware
from pneuforce.instrument.rig.link import RawSample
from pneuforce.protocol.frames import BoardState, Command, CommandFlag, Fault, Hello, Mode, Sample
from pneuforce.protocol.limits import HELD, HOST_SILENCE_S, PRESSURISED

log = logging.getLogger("pneuforce")


@dataclass(eq=False, repr=False)
class Instrument(InstrumentState):
    """Measuring instrument without I/O.

    Its inputs are samples, requests and the time. Its outputs are board commands and snapshots.
    """

    _interlocks: InterlockMonitor = field(default_factory=InterlockMonitor)
    _stall_report: StallReport = field(default_factory=StallReport, metadata={"state": False})
    #: Cached snapshots.
    _snapshots: dict[tuple[int, tuple[bool, ...], float, Peer], Snapshot] = field(
        default_factory=dict, metadata={"state": False}
    )

    # ---- input from the rig

    def identify_board(self, hello: Hello, firmware: Firmware | None) -> None:
        """Store the identity of the board. The firmware is None before the end of the handshake.

        If the board was replaced, the new board has another sensor: discard the zero adjustment, and trip.
        """
        self.revision += 1
        if self.hello is not None and hello.serial != self.hello.serial:
            self.chain.zero.clear()
            self.trip(HostFault.BOARD_RESET)
        self.hello, self.firmware = hello, firmware

    def board_restarted(self) -> None:
        """Trip because the board has restarted. The rig stays vented until a peer arms it again."""
        self.trip(HostFault.BOARD_RESET)

    def disconnected(self) -> None:
        """Trip because the port was lost. A fast reconnection does not prevent the trip."""
        if self.raw is not None:
            self.trip(HostFault.LINK_LOST)

    def process(self, raw: RawSample) -> Measurement:
        """Return the measurement of one sample. Trip at a fault of the board or a violated interlock."""
        self.revision += 1
        chain = self.chain
        chain.ambient.follow(self.recent_ambient_kpa(raw.t_s), in_contact=chain.tracker.in_contact)
        m = chain.step(raw)
        self._follow_board(raw.message, raw.t_s)
        if not self.command_monitor.state_credible:
            m = m.without_force()
        self._follow_proof_test(raw, m)
        if self.proof_tests.suspected:
            m = m.without_force(Quality.TESTING)
        if not self.reference_known(raw.t_s):
            m = m.without_contact_force(Quality.NO_BASELINE)
        self.raw, self.measurement = raw, m
        self.sample_counter += 1
        self.vent_monitor.step(raw, m.pressure_kpa, self.chain.zero.taken)
        fault = self._interlocks.step(raw, m, self.settings.contact_limit_kpa)
        if fault is not None:
            self.trip(fault)
        if not self.chain.zero.taken and self.chain.zero.take():
            log.info("zero taken: the sensor reads %.3f kPa when vented", self.chain.zero.zero_kpa)
        self._follow_force(m)
        return m

    def _follow_board(self, sample: Sample, now_s: float) -> None:
        if sample.state not in PRESSURISED:
            self.chain.reference_kpa = self.requested.reference_kpa
        for code in codes_of(sample.faults):
            if code not in self.clearing.faults:
                self.trip(code)
        if not self.command_monitor.follow(sample.state, self.holding, now_s):
            self.trip(HostFault.DISAGREEMENT if self._commands_hold else HostFault.NOT_VENTED)

    def _follow_force(self, m: Measurement) -> None:
        for peak in self.peaks.step(m):
            self.peak_force_n = peak.force_n
        if not self.tripped and math.isfinite(m.force_std_n):
            self.extremes.add(m.force_n)
        self._follow_alarm_2(m.t_s)
        if self.settings.vent_on_force_limit and self.holding and self.force_limit_exceeded:
            self.trip(HostFault.FORCE_LIMIT)

    def _follow_alarm_2(self, t_s: float) -> None:
        requested = self.requested
        self.alarm_2.step(
            t_s,
            self.alarm_force_n,
            held=self.sample is not None and self.sample.state in HELD,
            limit_n=requested.force_limit_2_n,
            hysteresis_n=requested.alarm_hysteresis_n,
            delay_s=requested.alarm_delay_s,
        )

    def _follow_proof_test(self, raw: RawSample, m: Measurement) -> None:
        """Evaluate a finished proof test, and request the next test when it is due."""
        tests, period_s = self.proof_tests, self.settings.proof_test_s
        verdict = self.chain.proof_test_verdict(raw)
        if verdict is not None:
            log_proof_test(verdict, self.chain.proof_test.ratio)
            if tests.finish(verdict, period_s):
                self.trip(Fault.OCCLUSION)
        free = raw.message.state == BoardState.HOLDING and not m.in_contact and math.isfinite(m.force_n)
        free = free and self.arming is Arming.HOLDING
        tests.step(raw.message.setpoint_pa, free, m.in_contact, raw.elapsed_s)
        if period_s and tests.due:
            since_s = oldest_forbidding_s(raw.t_s, period_s)
            if not self.peers.forbid_proof_tests(since_s):
                tests.request(period_s)

    # ---- input from the clock

    def tick(self, now_s: float) -> None:
        """Handle all effects of time: lost link, leases, delayed vents, commands in progress."""
        self.revision += 1
        self.check_stall(now_s)
        if self.link_lost(now_s) and self.sample is not None and not self.resuming(now_s):
            self.trip(HostFault.LINK_LOST)
        self._check_lease(now_s)
        self.command_monitor.set_command(self.holding, now_s)
        if self.vent_due_s is not None and not (self.measurement.in_contact and now_s <= self.vent_due_s):
            self.end_vent_delay()
        result = finish_clearing(self, now_s)
        if result is not None:
            self.peers.finish_commands(result)

    def check_stall(self, now_s: float) -> None:
        """Detect and log a stall of this process."""
        stall_s = self.stalls.update(now_s)
        if self.sample is not None and (sentence := self._stall_report.update(stall_s, now_s)):
            log.warning(sentence)

    def resuming(self, now_s: float) -> bool:
        """Return True shortly after a stall, because bytes from the stall may still be in the buffers.

        Repeated stalls postpone a trip at most until the host timeout. The board then vents by itself.
        """
        return self.stalls.buffered_s(now_s) > 0 and self.age_s(now_s) <= self.settings.host_timeout_s

    def _check_lease(self, now_s: float) -> None:
        """Trip if the lease has expired, unless its renewal may have waited in a buffer during a stall.

        Repeated stalls postpone the trip at most until the host timeout after the end of the lease.
        """
        stall_s = self.stalls.buffered_s(now_s)
        wait_s = stall_s + HOST_SILENCE_S if stall_s else 0.0
        if self.resuming(now_s):
            wait_s = max(wait_s, self.settings.host_timeout_s)
        if not self.lease.overdue_s(now_s) <= wait_s and self.lease.expire(now_s):
            self.trip_after_contact(HostFault.LEASE_EXPIRED, now_s)

    # ---- output to the rig

    @property
    def _commands_hold(self) -> bool:
        """Return True if the command for the board is hold, False if it is vent."""
        return self.holding and not self.command_monitor.vent_due

    def command(self) -> Command:
        """Return the command for the board."""
        hold = self._commands_hold
        zero = self.chain.zero
        pressed = self.measurement.in_contact or HostFault.LINK_LOST in self.faults  # perhaps, unseen
        flags = CommandFlag.IN_CONTACT if pressed else CommandFlag.NONE
        if zero.taken:
            flags |= CommandFlag.ZEROED
        return Command(
            mode=Mode.HOLD if hold else Mode.VENT,
            flags=flags,
            setpoint_pa=round(self.held_setpoint_kpa * 1e3) if hold else 0,
            zero_pa=round(zero.zero_kpa * 1e3) if zero.taken else 0,
            contact_limit_pa=round(self.settings.contact_limit_kpa * 1e3),
            host_timeout_ms=round(self.settings.host_timeout_s * 1e3),
            clear=self.clearing.count & 0xFF,
            proof_test=self.proof_tests.count & 0xFF,
        )

    # ---- output to the buses

    def snapshot(self, peer: Peer, now_s: float) -> Snapshot:
        """Return the snapshot for `peer` at `now_s`.

        The snapshot is cached, and the peers of a channel that have not written share it.
        """
        shown_to = peer if self.peers.knows(peer) else (peer[0], "")
        view = (self.revision, self.service_failures, now_s, shown_to)
        if view not in self._snapshots:
            self._snapshots = {view: snapshot_of(self, peer, now_s)}
        return self._snapshots[view]

    # ---- requests from the buses

    def write(self, peer: Peer, values: Mapping[str, Any], now_s: float) -> RejectReason:
        """Execute one request completely or not at all. A vent is always executed."""
        self.revision += 1
        self.check_stall(now_s)
        self._check_lease(now_s)
        record = self.peers.record_of(peer)
        record.written_s = now_s
        context = write_context_of(self, peer, now_s)
        reject_reason = authorize(peer, values, record, self.requested.setpoint_kpa, self.lease, context)
        if reject_reason is RejectReason.NONE:
            execute(self, peer, values, now_s)
        elif values.get("mode") == "vent":
            self.vent(now_s)
        record.reject_reason = reject_reason
        if "mode" in values:
            record.mode = values["mode"]
        log_write(peer, values, record)
        return reject_reason
