"""Snapshot: all quantities that a bus can show, at one instant and for one peer."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from pneuforce.instrument.core.command_block import CommandBlock
from pneuforce.instrument.core.faults import mask_of
from pneuforce.instrument.core.lease import Peer
from pneuforce.instrument.core.maintenance import maintenance_causes
from pneuforce.instrument.core.proof_test_schedule import oldest_forbidding_s
from pneuforce.instrument.core.state import InstrumentState
from pneuforce.instrument.core.status import STALE_S, status_of
from pneuforce.instrument.measurement.measurement import Measurement, Quality
from pneuforce.instrument.rig.firmware import Firmware
from pneuforce.protocol.frames import BoardState
from pneuforce.protocol.limits import HELD

MAX_AGE_S = 1e6
#: Reasons for which the force without lag compensation is not shown either.
_WITHOUT_FORCE = Quality.OUT_OF_RANGE | Quality.FLAT


class Snapshot(NamedTuple):
    """Values of all quantities at one instant. A measured value that is not available is NaN.

    The name of a quantity ends in its unit. The register map refers to the quantities by name.
    """

    # the measurement
    force_n: float
    force_std_n: float
    force_uncompensated_n: float
    force_lower_range_limit_n: float
    peak_force_n: float
    force_maximum_n: float
    force_minimum_n: float
    pressure_kpa: float
    baseline_pressure_kpa: float
    rise_kpa: float
    radius_mm: float
    indentation_mm: float
    contact_radius_mm: float
    drift_kpa_per_s: float
    baseline_age_s: float
    proof_test_age_s: float
    delay_s: float
    ambient_source: str
    ambient_in_effect_kpa: float
    ambient_age_s: float
    age_s: float
    sample_counter: int
    sample_time_ms: int
    sample_utc: int
    sample_utc_ms: int
    contact_counter: int
    peak_counter: int
    # the rig
    state: str
    status: frozenset[str]
    maintenance_causes: frozenset[str]
    setpoint_kpa: float
    first_out_fault: int
    active_fault_count: int
    faults: tuple[int, ...]  # codes of the latched faults, in the order of their occurrence
    latched_faults_1: int
    latched_faults_2: int
    # requested values
    setpoint_requested_kpa: float
    force_limit_n: float
    force_limit_2_n: float
    alarm_hysteresis_n: float
    alarm_delay_s: float
    mode: str
    reference_pressure_kpa: float
    ambient_pressure_kpa: float
    proof_test: str
    lease_s: float
    lease_left_s: float
    lease_holder: str
    reject_reason: str
    # the command block
    command_key: int
    command_code: str
    command_argument: int
    command_sequence: int
    answer_sequence: int
    answer_state: str
    answer_result: str
    # adjustment and identity
    zero_offset_kpa: float
    filter_samples: int
    method: str
    configuration_hash: int
    map_hash: int
    serial_number: int
    calibration_date: int
    balloon_id: int
    inflation_count: int
    firmware_version: int
    firmware_origin: str
    firmware_image: int
    event_log_records: int
    event_log_digest_1: int
    event_log_digest_2: int
    configuration_signature: str
    calibration_signature: str


def snapshot_of(state: InstrumentState, peer: Peer, now_s: float) -> Snapshot:
    """Return the snapshot for `peer` at `now_s`. A stale measurement is shown as not available."""
    stale = not state.age_s(now_s) <= STALE_S
    m = _available(state, stale)
    return Snapshot(
        state=state_of(state),
        status=status_of(state, m, now_s),
        maintenance_causes=maintenance_causes(state, now_s),
        **_measurement_values(state, m, now_s),
        **_control_values(state, stale),
        **_ambient_values(state, now_s),
        **_sample_times(state),
        **_requested_values(state, peer, now_s),
        **_command_values(state.peers.last_command(peer)),
        **_identity_values(state),
    )


def _available(state: InstrumentState, stale: bool) -> Measurement:
    """Return the latest measurement without the values that are not available.

    A stale measurement has no values. While the rig is tripped, only the pressure is available.
    """
    m = state.measurement
    if stale:
        return Measurement(t_s=m.t_s)
    return m.without_force() if state.tripped else m


def _measurement_values(state: InstrumentState, m: Measurement, now_s: float) -> dict[str, Any]:
    chain, age_s = state.chain, state.age_s(now_s)
    locked = math.isfinite(m.rise_kpa)
    return {
        "force_n": m.force_n,
        "force_std_n": m.force_std_n,
        "force_uncompensated_n": math.nan if m.quality & _WITHOUT_FORCE else m.force_uncompensated_n,
        "force_lower_range_limit_n": m.force_lower_range_limit_n,
        "peak_force_n": state.peak_force_n,
        "force_maximum_n": state.extremes.maximum_n,
        "force_minimum_n": state.extremes.minimum_n,
        "pressure_kpa": m.pressure_kpa,
        "baseline_pressure_kpa": m.baseline_kpa,
        "rise_kpa": m.rise_kpa,
        "radius_mm": m.radius_mm,
        "indentation_mm": m.indentation_mm,
        "contact_radius_mm": m.contact_radius_mm,
        "drift_kpa_per_s": chain.tracker.drift_kpa_per_s if locked else math.nan,
        "baseline_age_s": _finite_or_nan(chain.tracker.baseline_age_s + age_s),
        "proof_test_age_s": _finite_or_nan(state.proof_tests.age_s),
        "delay_s": chain.delay_s if locked else math.nan,
        "age_s": min(age_s, MAX_AGE_S),
        "sample_counter": state.sample_counter,
        "contact_counter": chain.tracker.contact_count,
        "peak_counter": state.peaks.count,
    }


def _ambient_values(state: InstrumentState, now_s: float) -> dict[str, Any]:
    chain = state.chain
    return {
        "ambient_source": "measured" if chain.ambient.is_measured else "configured",
        "ambient_in_effect_kpa": chain.ambient.kpa(chain.settings),
        "ambient_age_s": _finite_or_nan(now_s - state.requested.ambient_written_s),
    }


def _sample_times(state: InstrumentState) -> dict[str, Any]:
    """Return the time of the last sample on both clocks. Each part is 0 while it is unknown."""
    t_s, utc_s = state.measurement.t_s, state.measurement.t_s + state.utc_offset_s
    whole_s, ms = divmod(math.floor(utc_s * 1e3), 1000) if math.isfinite(utc_s) else (0, 0)
    return {
        "sample_time_ms": math.floor(t_s * 1e3) if math.isfinite(t_s) else 0,
        "sample_utc": whole_s,
        "sample_utc_ms": ms,
    }


def _finite_or_nan(age_s: float) -> float:
    """Return an age [s], NaN for an infinite age: the event has not happened yet."""
    return age_s if math.isfinite(age_s) else math.nan


def _control_values(state: InstrumentState, stale: bool) -> dict[str, Any]:
    in_effect = state.sample.setpoint_pa if state.sample and state.holding and not stale else 0
    return {
        "setpoint_kpa": in_effect / 1e3 if in_effect else math.nan,
        "first_out_fault": state.faults.first,
        "active_fault_count": len(state.faults),
        "faults": tuple(state.faults),
        "latched_faults_1": mask_of(code for code in state.faults if code < 32),
        "latched_faults_2": mask_of(code - 32 for code in state.faults if code >= 32),
        "inflation_count": state.inflation_count,
        "balloon_id": state.balloon_id,
    }


def _requested_values(state: InstrumentState, peer: Peer, now_s: float) -> dict[str, Any]:
    requested, lease = state.requested, state.lease
    return {
        "setpoint_requested_kpa": requested.setpoint_kpa,
        "force_limit_n": requested.force_limit_n,
        "force_limit_2_n": requested.force_limit_2_n,
        "alarm_hysteresis_n": requested.alarm_hysteresis_n,
        "alarm_delay_s": requested.alarm_delay_s,
        "mode": requested.mode,
        "reference_pressure_kpa": requested.reference_kpa,
        "ambient_pressure_kpa": requested.ambient_kpa,
        "proof_test": state.peers.proof_test_of(
            peer, oldest_forbidding_s(now_s, state.settings.proof_test_s)
        ),
        "lease_s": lease.duration_s,
        "lease_left_s": lease.left_s(now_s),
        "lease_holder": lease.holder[0] if lease.holder else "none",
        "reject_reason": state.peers.reject_reason_of(peer),
    }


def writable_values(state: InstrumentState, peer: Peer, now_s: float) -> dict[str, Any]:
    """Return the present values of all quantities that can be written."""
    return _requested_values(state, peer, now_s) | _command_values(state.peers.last_command(peer))


def _command_values(block: CommandBlock) -> dict[str, Any]:
    return {
        "command_key": block.key,
        "command_code": block.code,
        "command_argument": block.argument,
        "command_sequence": block.sequence,
        "answer_sequence": block.answer_sequence,
        "answer_state": block.answer_state,
        "answer_result": block.answer_result,
    }


def _identity_values(state: InstrumentState) -> dict[str, Any]:
    identity, settings = state.settings.identity, state.chain.settings
    firmware, head = state.firmware or Firmware(0, None), state.event_log_head
    return {
        "zero_offset_kpa": -state.chain.zero.zero_kpa,
        "filter_samples": settings.filter_samples,
        "method": settings.law.method + ("_calibrated" if settings.correction else ""),
        "configuration_hash": identity.configuration_hash,
        "map_hash": identity.map_hash,
        "serial_number": identity.serial_number,
        "calibration_date": identity.calibration_date,
        "firmware_version": firmware.version,
        "firmware_origin": firmware.origin,
        "firmware_image": firmware.image_crc or 0,
        "event_log_records": head.records,
        "event_log_digest_1": head.digest_word(0),
        "event_log_digest_2": head.digest_word(1),
        "configuration_signature": identity.configuration_signature,
        "calibration_signature": identity.calibration_signature,
    }


def state_of(state: InstrumentState) -> str:
    """Return the name of the rig's state.

    The name is "boot" before the first sample and "tripped" after a trip, for example by a lost link.
    Otherwise it is the state in the last sample, also after a stall of the host, which is no trip. A proof
    test is a part of the state "holding".
    """
    if state.sample is None:
        return "boot"
    if state.tripped:
        return "tripped"
    return "holding" if state.sample.state in HELD else BoardState(state.sample.state).name.lower()
