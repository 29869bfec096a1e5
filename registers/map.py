"""Register map: the only declaration of each register's address, type, unit, scale, range and meaning."""

from __future__ import annotations

from dataclasses import dataclass

from pneuforce.registers.codes import (
    AMBIENT_SOURCES,
    ANSWERS,
    COMMANDS,
    CONDENSED,
    FAULTS,
    HOLDERS,
    METHODS,
    MODES,
    PROOF_TESTS,
    REJECT_REASONS,
    STATES,
    STATUS,
    STATUS_HIGH,
    STATUS_LOW,
)
from pneuforce.registers.field import Field, WireType

MAP_VERSION = 1

COMMAND_KEY = 0x5046


@dataclass(frozen=True, slots=True, kw_only=True)
class Register(Field):
    """Field at an address of the Modbus map. Addresses start at 0 and count 16-bit words."""

    address: int
    writable: bool = False

    @property
    def end(self) -> int:
        """Return the first address after this register."""
        return self.address + self.wire.words


F32, U32, I16, U16 = WireType.F32, WireType.U32, WireType.I16, WireType.U16

REGISTERS: tuple[Register, ...] = (
    Register(address=0, name="force", wire=F32, unit="N", quantity="force_n", low=-20, high=20,
             doc="Contact force; positive when an object presses on the balloon."),
    Register(address=2, name="force_uncertainty", wire=F32, unit="N", quantity="force_std_n", low=0, high=20,
             doc="Standard uncertainty of the force. Without contact: the detection limit."),
    Register(address=4, name="pressure", wire=F32, unit="kPa", quantity="pressure_kpa", low=-5, high=50,
             doc="Filtered gauge pressure."),
    Register(address=6, name="radius", wire=F32, unit="mm", quantity="radius_mm", low=7, high=10,
             doc="Radius R_i of the inflated balloon before contact."),
    Register(address=8, name="setpoint", wire=F32, unit="kPa", quantity="setpoint_kpa", low=2, high=12,
             doc="Setpoint in effect; not available while the rig is vented or tripped."),
    Register(address=10, name="baseline_pressure", wire=F32, unit="kPa", quantity="baseline_pressure_kpa",
             low=-5, high=25,
             doc="Baseline pressure ΔP_i. During a contact: the value at the start of the contact."),
    Register(address=12, name="rise", wire=F32, unit="kPa", quantity="rise_kpa", low=-5, high=30,
             doc="Pressure rise ΔP_f − ΔP_i."),
    Register(address=14, name="indentation", wire=F32, unit="mm", quantity="indentation_mm", low=0, high=10,
             doc="Indentation depth d."),
    Register(address=16, name="contact_radius", wire=F32, unit="mm", quantity="contact_radius_mm", low=0,
             high=20, doc="Radius a of the contact area."),
    Register(address=18, name="peak_force", wire=F32, unit="N", quantity="peak_force_n", low=-20, high=20,
             doc="Force of the last completed peak."),
    Register(address=20, name="status", wire=U32, quantity="status", bits=STATUS,
             doc="Status bits. The discrete inputs 0–31 are the same bits."),
    Register(address=22, name="sample_counter", wire=U32, quantity="sample_counter",
             doc="Number of evaluated samples. Wraps to 0."),
    Register(address=24, name="sample_age", wire=U16, unit="ms", quantity="age_s", always_available=True,
             doc="Age of the last sample. 65535 means 65.535 s or more."),
    Register(address=25, name="state", wire=U16, quantity="state", values=STATES, doc="State of the rig."),
    Register(address=26, name="contact_counter", wire=U16, quantity="contact_counter",
             doc="Number of contacts that have started. Wraps to 0."),
    Register(address=27, name="reject_reason", wire=U16, quantity="reject_reason", values=REJECT_REASONS,
             doc="Reason why the last valid write of this peer was rejected; 0 if the write was accepted. An "
                 "invalid write (exceptions 01–03) does not change the reason."),
    Register(address=28, name="force_lower_range_limit", wire=F32, unit="N",
             quantity="force_lower_range_limit_n", low=0, high=20,
             doc="Lower limit of the model's range at this ΔP_i: the force at a rise of 0.5 kPa."),
    Register(address=30, name="force_uncompensated", wire=F32, unit="N", quantity="force_uncompensated_n",
             low=-20, high=20, doc="Force without compensation of the delay."),
    Register(address=32, name="baseline_drift", wire=F32, unit="kPa/s", quantity="drift_kpa_per_s", low=-10,
             high=10, doc="Drift of the baseline pressure."),
    Register(address=34, name="delay", wire=U16, unit="ms", quantity="delay_s",
             doc="Remaining delay of the force after the compensation."),
    Register(address=35, name="baseline_age", wire=U16, unit="s", quantity="baseline_age_s",
             doc="Age of the baseline pressure; not available before the first baseline."),
    Register(address=36, name="proof_test_age", wire=U16, unit="s", quantity="proof_test_age_s",
             doc="Time since a proof test passed, or since a new setpoint."),
    Register(address=37, name="peak_counter", wire=U16, quantity="peak_counter",
             doc="Number of completed peaks of the force. Wraps to 0."),
    Register(address=38, name="force_maximum", wire=F32, unit="N", quantity="force_maximum_n", low=-20,
             high=20, doc="Largest valid force of all samples since command 6 or since the start of the "
             "host process."),
    Register(address=40, name="force_minimum", wire=F32, unit="N", quantity="force_minimum_n", low=-20,
             high=20, doc="Smallest valid force of all samples since command 6 or since the start of the "
             "host process. It is 0 N after a sample without contact."),
    Register(address=42, name="sample_time", wire=U32, quantity="sample_time_ms",
             doc="Time in ms at which the board took the last sample, on the monotonic clock of the host. "
             "Wraps to 0 after 49.7 days."),
    Register(address=44, name="sample_utc", wire=U32, quantity="sample_utc",
             doc="The same time as UTC, in seconds since 1970-01-01; 0 if unknown. The clock may be wrong or "
             "jump."),
    Register(address=46, name="sample_utc_fraction", wire=U16, quantity="sample_utc_ms",
             doc="Milliseconds of the time in register 44, 0 to 999."),
    Register(address=47, name="ambient_source", wire=U16, quantity="ambient_source", values=AMBIENT_SOURCES,
             doc="Source of the ambient pressure in effect: the configuration, or register 556."),
    Register(address=48, name="ambient_in_effect", wire=F32, unit="kPa", quantity="ambient_in_effect_kpa",
             low=60, high=110, doc="Absolute ambient pressure P_0 in effect. A contact does not change it."),
    Register(address=50, name="ambient_age", wire=U16, unit="s", quantity="ambient_age_s",
             doc="Time since the last accepted write of register 556."),
    Register(address=64, name="force_mn", wire=I16, unit="mN", quantity="force_n", doc="Contact force."),
    Register(address=65, name="force_uncertainty_mn", wire=U16, unit="mN", quantity="force_std_n",
             doc="Standard uncertainty of the force."),
    Register(address=66, name="pressure_pa", wire=I16, unit="Pa", quantity="pressure_kpa",
             doc="Filtered gauge pressure."),
    Register(address=67, name="radius_um", wire=U16, unit="µm", quantity="radius_mm",
             doc="Radius R_i of the inflated balloon before contact."),
    Register(address=68, name="setpoint_pa", wire=I16, unit="Pa", quantity="setpoint_kpa",
             doc="Setpoint in effect."),
    Register(address=69, name="rise_pa", wire=I16, unit="Pa", quantity="rise_kpa",
             doc="Pressure rise ΔP_f − ΔP_i."),
    Register(address=70, name="peak_force_mn", wire=I16, unit="mN", quantity="peak_force_n",
             doc="Force of the last completed peak."),
    Register(address=71, name="condensed_status", wire=U16, quantity="status", bits=CONDENSED,
             doc="Condensed status bits."),
    Register(address=72, name="status_low", wire=U16, quantity="status", bits=STATUS_LOW,
             doc="Status bits 0–15."),
    Register(address=73, name="status_high", wire=U16, quantity="status", bits=STATUS_HIGH,
             doc="Status bits 16–31."),
    Register(address=512, name="setpoint_requested", wire=F32, unit="kPa", quantity="setpoint_requested_kpa",
             low=2, high=12, writable=True, doc="Requested setpoint."),
    Register(address=514, name="force_limit", wire=F32, unit="N", quantity="force_limit_n", low=0.1, high=20,
             writable=True, doc="Force alarm limit (status bit 6)."),
    Register(address=516, name="mode", wire=U16, quantity="mode", values=MODES, writable=True,
             doc="0: vent, always accepted. 1: inflate to the setpoint, then close both valves."),
    Register(address=517, name="lease", wire=U16, unit="ms", quantity="lease_s", low=200, high=60000,
             also_allowed=(0,), always_available=True, writable=True,
             doc="Lease time; 0: no lease. The holder must write again within this time."),
    Register(address=518, name="reference_pressure", wire=F32, unit="kPa", quantity="reference_pressure_kpa",
             low=-1, high=3, writable=True,
             doc="Gauge pressure around the balloon (insufflation). Writable only while vented; with "
             "reference_timeout_s in the configuration, at any time."),
    Register(address=520, name="command_key", wire=U16, quantity="command_key", low=COMMAND_KEY,
             high=COMMAND_KEY, writable=True, doc="Key of the command: always 5046h."),
    Register(address=521, name="command_code", wire=U16, quantity="command_code", values=COMMANDS,
             writable=True, doc="Code of the command."),
    Register(address=522, name="command_argument", wire=U16, quantity="command_argument", writable=True,
             doc="Argument of the command."),
    Register(address=523, name="command_sequence", wire=U16, quantity="command_sequence", writable=True,
             doc="Sequence number. A new value starts the command; the same value repeats the answer."),
    Register(address=524, name="answer_sequence", wire=U16, quantity="answer_sequence",
             doc="Answer: sequence number of the command."),
    Register(address=525, name="answer_state", wire=U16, quantity="answer_state", values=ANSWERS,
             doc="Answer: state of the command."),
    Register(address=526, name="answer_result", wire=U16, quantity="answer_result", values=REJECT_REASONS,
             doc="Answer: 0 if successful, otherwise a reject reason."),
    Register(address=528, name="lease_left", wire=U16, unit="ms", quantity="lease_left_s",
             always_available=True, doc="Remaining lease time."),
    Register(address=529, name="lease_holder", wire=U16, quantity="lease_holder", values=HOLDERS,
             doc="Bus of the lease holder."),
    Register(address=544, name="setpoint_requested_pa", wire=U16, unit="Pa", low=2000, high=12000,
             quantity="setpoint_requested_kpa", writable=True,
             doc="Requested setpoint, for masters that can write only single registers."),
    Register(address=545, name="force_limit_mn", wire=U16, unit="mN", low=100, high=20000,
             quantity="force_limit_n", writable=True,
             doc="Force alarm limit, for masters that can write only single registers."),
    Register(address=546, name="proof_test", wire=U16, quantity="proof_test", values=PROOF_TESTS,
             writable=True, doc="Proof tests. 0: allowed. 1: forbidden, for example during a movement of the "
             "robot."),
    Register(address=547, name="reference_pressure_pa", wire=I16, unit="Pa", low=-1000, high=3000,
             quantity="reference_pressure_kpa", writable=True,
             doc="Gauge pressure around the balloon, for masters that can write only single registers."),
    Register(address=548, name="force_limit_2", wire=F32, unit="N", quantity="force_limit_2_n", low=0.1,
             high=20, writable=True, doc="Second force alarm limit (status bit 30)."),
    Register(address=550, name="alarm_hysteresis", wire=F32, unit="N", quantity="alarm_hysteresis_n", low=0,
             high=10, writable=True,
             doc="Hysteresis of the second force alarm: the alarm ends at the limit minus this force."),
    Register(address=552, name="alarm_delay", wire=U16, unit="ms", quantity="alarm_delay_s", low=0,
             high=10000, writable=True,
             doc="Delay of the second force alarm: time for which the force must be above the limit."),
    Register(address=553, name="force_limit_2_mn", wire=U16, unit="mN", low=100, high=20000,
             quantity="force_limit_2_n", writable=True,
             doc="Second force alarm limit, for masters that can write only single registers."),
    Register(address=554, name="alarm_hysteresis_mn", wire=U16, unit="mN", low=0, high=10000,
             quantity="alarm_hysteresis_n", writable=True,
             doc="Hysteresis of the second force alarm, for masters that can write only single registers."),
    Register(address=556, name="ambient_pressure", wire=F32, unit="kPa", quantity="ambient_pressure_kpa",
             low=60, high=110, writable=True,
             doc="Measured absolute ambient pressure P_0. Used from the next contact on, until "
             "ambient_timeout_s after its last write."),
    Register(address=768, name="map_version", wire=U16, constant=MAP_VERSION,
             doc="Version of this register map."),
    Register(address=769, name="method", wire=U16, quantity="method", values=METHODS,
             doc="Code of the force model, plus 256 if a force calibration is applied."),
    Register(address=770, name="map_hash", wire=U32, quantity="map_hash",
             doc="Hash of all declarations: registers, CAN frames and CANopen objects."),
    Register(address=772, name="configuration_hash", wire=U32, quantity="configuration_hash",
             doc="Hash of the configuration and the calibration."),
    Register(address=774, name="serial_number", wire=U32, quantity="serial_number",
             doc="Serial number of the instrument."),
    Register(address=776, name="calibration_date", wire=U32, quantity="calibration_date",
             doc="Calibration date as yyyymmdd; 0 if not calibrated."),
    Register(address=778, name="first_out_fault", wire=U16, quantity="first_out_fault", legend=FAULTS,
             doc="Code of the first-out fault; 0 if no fault is latched."),
    Register(address=779, name="active_fault_count", wire=U16, quantity="active_fault_count",
             doc="Number of latched faults."),
    Register(address=780, name="balloon_id", wire=U32, quantity="balloon_id",
             doc="Number of the balloon, from the configuration or from the last command 5."),
    Register(address=782, name="inflation_count", wire=U32, quantity="inflation_count",
             doc="Number of inflations since the balloon was fitted, or since the host process started."),
    Register(address=784, name="event_log_records", wire=U32, quantity="event_log_records",
             doc="Number of records of the event log on the disk; 0 without an event log."),
    Register(address=786, name="event_log_digest_1", wire=U32, quantity="event_log_digest_1",
             doc="Digest of the last record of the event log: the first 8 hexadecimal digits."),
    Register(address=788, name="event_log_digest_2", wire=U32, quantity="event_log_digest_2",
             doc="Digest of the last record of the event log: the next 8 hexadecimal digits."),
    Register(address=3840, name="test_float", wire=F32, constant=-123.45, doc="Test pattern −123.45."),
    Register(address=3842, name="test_long", wire=U32, constant=0x12345678, doc="Test pattern 12345678h."),
    Register(address=3844, name="test_int", wire=I16, constant=-12345, doc="Test pattern −12345."),
)  # fmt: skip

#: First and last address of each readable block. Reserved addresses in a block read 0 and reject writes.
BLOCKS: tuple[tuple[int, int], ...] = ((0, 127), (512, 575), (768, 799), (3840, 3855))

BY_NAME = {register.name: register for register in REGISTERS}
