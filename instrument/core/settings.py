"""Settings of the instrument core, derived from the configuration."""

from __future__ import annotations

from dataclasses import dataclass, field

from pneuforce.instrument.measurement.chain_settings import ChainSettings


@dataclass(frozen=True, slots=True, kw_only=True)
class Identity:
    """Identity of the instrument, readable on every bus."""

    serial_number: int = 0
    calibration_date: int = 0
    configuration_hash: int = 0
    map_hash: int = 0
    balloon_id: int = 0
    #: Names of the states of the signatures, for example "signed".
    configuration_signature: str = "unsigned"
    calibration_signature: str = "no_file"


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """Settings of the instrument core."""

    chain: ChainSettings = field(default_factory=ChainSettings)
    contact_limit_kpa: float = 18.0  #: the locked balloon is vented above this pressure
    identity: Identity = field(default_factory=Identity)
    force_limit_n: float = 5.0
    force_limit_2_n: float = 10.0
    alarm_hysteresis_n: float = 0.1  #: of the second force alarm
    alarm_delay_s: float = 0.0  #: of the second force alarm
    vent_on_force_limit: bool = False
    host_timeout_s: float = 2.0
    #: Time after a write of the reference pressure in which the force is valid; 0: always valid.
    reference_timeout_s: float = 0.0
    ambient_timeout_s: float = 600.0  #: time after a write of the ambient pressure in which it is used
    ambient_required: bool = False  #: without a recent ambient pressure, maintenance is required
    proof_test_s: float = 60.0  #: time from one proof test to the next; 0: no proof tests
    #: Reject an inflation if the image of the firmware is not a released image.
    require_released_firmware: bool = False
    write_protect: bool = False
    lease_required: bool = False
