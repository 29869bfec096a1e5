"""A snapshot: every quantity that a bus may show, at one instant, as one peer sees it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

from instrument.commands import CommandBlock
from instrument.lease import Peer
from instrument.measurement import Measurement, Quality
from instrument.rig.frames import BoardState
from instrument.status import STALE_S, status_of

if TYPE_CHECKING:
    from instrument.core import Instrument

AGE_LIMIT_S = 1e6


class Snapshot(NamedTuple):
    """All from one measurement and one moment; NaN where a quantity is not available.

    The names end in their units; the register map binds to them by name.
    """

    # the measurement
    force_n: float
    force_std_n: float
    force_uncompensated_n: float
    force_low_n: float
    peak_force_n: float
    pressure_kpa: float
    initial_pressure_kpa: float
    rise_kpa: float
    radius_mm: float
    indentation_mm: float
    contact_radius_mm: float
    drift_kpa_per_s: float
    baseline_age_s: float
    delay_s: float
    age_s: float
    sample_counter: int
    contact_counter: int
    # the rig
    state: str
    status: frozenset[str]
    setpoint_kpa: float
    first_fault: int
    active_faults: int
    faults: tuple[int, ...]  # codes, in the order of their coming
    # what was asked
    setpoint_requested_kpa: float
    force_limit_n: float
    mode: str
    reference_pressure_kpa: float
    lease_s: float
    lease_left_s: float
    lease_holder: str
    refusal: str
    # the command block
    command_key: int
    command_code: str
    command_argument: int
    command_sequence: int
    answer_sequence: int
    answer_state: str
    answer_result: str
    # who it is
    method: str
    configuration_hash: int
    serial_number: int
    calibration_date: int
    balloon_id: int
    inflations: int


def snapshot_of(instrument: Instrument, peer: Peer, now_s: float) -> Snapshot:
    """What `peer` may see of the instrument at `now_s`. A stale measurement is shown as not available."""
    stale = not instrument.age_s(now_s) <= STALE_S
    m = _shown(instrument, stale)
    return Snapshot(
        state=state_of(instrument, instrument.link_lost(now_s)),
        status=status_of(instrument, m, now_s),
        **_measured(instrument, m, now_s),
        **_controlled(instrument, stale),
        **_asked(instrument, peer, now_s),
        **_answered(instrument.commands(peer)),
        **_identity(instrument),
    )


def _shown(instrument: Instrument, stale: bool) -> Measurement:
    """The latest measurement, without what is not available: all of it when stale, the force when tripped."""
    m = instrument.measurement
    if stale:
        return Measurement(t_s=m.t_s)
    if instrument.tripped:
        return Measurement(
            t_s=m.t_s,
            pressure_kpa=m.pressure_kpa,
            unfiltered_kpa=m.unfiltered_kpa,
            quality=m.quality | Quality.NOT_HOLDING,
        )
    return m


def _measured(instrument: Instrument, m: Measurement, now_s: float) -> dict[str, Any]:
    chain, age_s = instrument.chain, instrument.age_s(now_s)
    locked = math.isfinite(m.rise_kpa)
    return {
        "force_n": m.force_n,
        "force_std_n": m.force_std_n,
        "force_uncompensated_n": math.nan if Quality.OUT_OF_RANGE in m.quality else m.force_uncompensated_n,
        "force_low_n": m.force_low_n,
        "peak_force_n": instrument.peak_force_n,
        "pressure_kpa": m.pressure_kpa,
        "initial_pressure_kpa": m.initial_kpa,
        "rise_kpa": m.rise_kpa,
        "radius_mm": m.radius_mm,
        "indentation_mm": m.indentation_mm,
        "contact_radius_mm": m.contact_radius_mm,
        "drift_kpa_per_s": chain.tracker.drift_kpa_per_s if locked else math.nan,
        "baseline_age_s": min(chain.tracker.baseline_age_s + age_s, AGE_LIMIT_S),
        "delay_s": chain.delay_s if locked else math.nan,
        "age_s": min(age_s, AGE_LIMIT_S),
        "sample_counter": instrument.sample_counter,
        "contact_counter": chain.tracker.count,
    }


def _controlled(instrument: Instrument, stale: bool) -> dict[str, Any]:
    in_effect = instrument.sample.setpoint_pa if instrument.sample and instrument.holding and not stale else 0
    return {
        "setpoint_kpa": in_effect / 1e3 if in_effect else math.nan,
        "first_fault": instrument.faults.first,
        "active_faults": len(instrument.faults),
        "faults": tuple(instrument.faults),
        "inflations": instrument.inflations,
        "balloon_id": instrument.balloon_id,
    }


def _asked(instrument: Instrument, peer: Peer, now_s: float) -> dict[str, Any]:
    wanted, lease = instrument.wanted, instrument.lease
    return {
        "setpoint_requested_kpa": wanted.setpoint_kpa,
        "force_limit_n": wanted.force_limit_n,
        "mode": wanted.mode,
        "reference_pressure_kpa": wanted.reference_kpa,
        "lease_s": lease.duration_s,
        "lease_left_s": lease.left_s(now_s),
        "lease_holder": lease.holder[0] if lease.holder else "none",
        "refusal": instrument.peers.refusal_of(peer),
    }


def standing(instrument: Instrument, peer: Peer, now_s: float) -> dict[str, Any]:
    """Every quantity that can be written, as it stands: what a write is about to change."""
    return _asked(instrument, peer, now_s) | _answered(instrument.commands(peer))


def _answered(commands: CommandBlock) -> dict[str, Any]:
    return {
        "command_key": commands.key,
        "command_code": commands.code,
        "command_argument": commands.argument,
        "command_sequence": commands.sequence,
        "answer_sequence": commands.answer_sequence,
        "answer_state": commands.answer_state,
        "answer_result": commands.answer_result,
    }


def _identity(instrument: Instrument) -> dict[str, Any]:
    identity, chain = instrument.settings.identity, instrument.chain.settings
    return {
        "method": chain.law.method + ("_calibrated" if chain.correction else ""),
        "configuration_hash": identity.configuration_hash,
        "serial_number": identity.serial_number,
        "calibration_date": identity.calibration_date,
    }


def state_of(instrument: Instrument, lost: bool) -> str:
    """Name of the rig's state: the board's, unless the host has tripped or never heard a board."""
    if instrument.sample is None:
        return "boot"
    if lost or instrument.tripped:
        return "tripped"
    return BoardState(instrument.sample.state).name.lower()
