"""A snapshot: every quantity that a bus may show, at one instant, as one peer sees it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Snapshot:
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
