"""Names of all codes and bits: the enumerations and bit fields that every bus uses."""

from __future__ import annotations

from pneuforce.registers.field import BitField, Enumeration, StatusBit

STATUS = BitField(
    (
        StatusBit(0, "in_contact", "An object presses on the balloon."),
        StatusBit(1, "inflating", "The balloon is being inflated, or the pressure is settling."),
        StatusBit(2, "holding", "The setpoint was reached, and both valves are closed."),
        StatusBit(
            3,
            "vented",
            "The vent is verified: for 0.5 s, no valve has had current and the pressure was -0.3 to 0.3 kPa. "
            "Without a zero: the board reports vented. Never set with stale, link_lost or vent_fault. "
            "After a blocked tube (maintenance cause tube_unproven), it does not prove an empty balloon.",
        ),
        StatusBit(
            4,
            "interpolated",
            "The pressure rise is below 0.5 kPa (method membrane: 0.1 kPa): the force is only approximate.",
        ),
        StatusBit(
            5,
            "out_of_range",
            "ΔP_i is outside 4.95–11.45 kPa, the balloon may be pressed flat, the model has no solution, or "
            "the calibrated force is not plausible: no force is available.",
        ),
        StatusBit(
            6,
            "force_high_alarm",
            "The force is above the force limit (register 514), or the balloon may be pressed flat.",
        ),
        StatusBit(7, "setpoint_not_reached", "The setpoint was not reached in time.", latches=True),
        StatusBit(8, "stale", "The last sample is older than 100 ms: measured values are not available."),
        StatusBit(9, "link_lost", "No frame has arrived from the rig for more than 250 ms."),
        StatusBit(
            10,
            "sensor_fault",
            "The pressure sensor is open or shorted, or its signal is frozen.",
            latches=True,
        ),
        StatusBit(11, "overpressure", "The pressure exceeded a limit.", latches=True),
        StatusBit(12, "leak", "The pressure falls steadily without contact.", latches=True),
        StatusBit(13, "burst", "The balloon has burst, or is past its limit point.", latches=True),
        StatusBit(14, "lease_expired", "A lease expired.", latches=True),
        StatusBit(15, "simulated", "The values come from a simulation or a replay, not from a real rig."),
        StatusBit(
            16,
            "not_zeroed",
            "The pressure sensor has no zero adjustment since the start or since the board was replaced: an "
            "inflation is rejected.",
        ),
        StatusBit(
            17,
            "write_protect",
            "The configuration rejects each write except a vent, on every bus and on the web page.",
        ),
        StatusBit(18, "board_watchdog", "The watchdog or a brown-out restarted the board.", latches=True),
        StatusBit(
            19,
            "can_down",
            "The CAN interface does not work. Also in the first 1.2 s after a start, until the node sends.",
        ),
        StatusBit(20, "inlet_fault", "The inlet valve is stuck, or there is no gas supply.", latches=True),
        StatusBit(
            21,
            "vent_fault",
            "The vent valve is stuck, or the tube is blocked: the balloon may be inflated.",
            latches=True,
        ),
        StatusBit(22, "board_reset", "The board restarted.", latches=True),
        StatusBit(23, "baseline_old", "The baseline pressure is older than 60 s, drifts, or is unknown."),
        StatusBit(
            24, "maintenance_required", "Maintenance required (NAMUR NE 107): check the instrument soon."
        ),
        StatusBit(
            25,
            "out_of_specification",
            "Out of specification (NAMUR NE 107): the same condition as out_of_range.",
        ),
        StatusBit(
            26,
            "function_check",
            "Function check (NAMUR NE 107): vented, inflating, settling, or a proof test is in progress.",
        ),
        StatusBit(27, "failure", "Failure (NAMUR NE 107): a fault is latched, or the last sample is stale."),
        StatusBit(28, "calibrated", "The force is corrected by a force calibration."),
        StatusBit(
            29, "proof_test_overdue", "No proof test has passed for ten periods, or proof tests are disabled."
        ),
        StatusBit(
            30,
            "force_high_alarm_2",
            "The force is above the second force limit, or the balloon may be pressed flat; "
            "with hysteresis and delay.",
        ),
        StatusBit(31, "any_failure", "Copy of bit 27, for masters that test the sign of the status."),
    )
)

STATUS_LOW = BitField(tuple(bit for bit in STATUS.bits if bit.number < 16))
STATUS_HIGH = BitField(
    tuple(StatusBit(b.number - 16, b.name, b.doc, b.latches) for b in STATUS.bits if b.number >= 16)
)

#: Causes of status bit 24. `instrument/core/maintenance.py` contains their conditions.
MAINTENANCE_CAUSES = BitField(
    (
        StatusBit(0, "leak", "The pressure of the locked balloon fell slowly and steadily."),
        StatusBit(1, "can_down", "The CAN interface does not work."),
        StatusBit(2, "clock_inaccurate", "The clock of the board is more than 1 % fast or slow."),
        StatusBit(3, "event_log_failed", "The event log cannot be written."),
        StatusBit(4, "recording_failed", "A recording has stopped because of an error."),
        StatusBit(
            5,
            "certificate_expiring",
            "A certificate has expired or expires in less than 30 days, or the list of revoked certificates "
            "has ended or ends soon.",
        ),
        StatusBit(
            6,
            "ambient_missing",
            "The configuration requires a measured ambient pressure, and none was written recently.",
        ),
        StatusBit(7, "firmware_unknown", "The firmware of the board is not a released image."),
        StatusBit(
            8,
            "tube_unproven",
            "The tube was blocked, and no proof test has passed since: the balloon may be inflated although "
            "the sensor reads 0 kPa.",
        ),
    )
)

CONDENSED = BitField(
    (
        StatusBit(0, "in_contact", "An object presses on the balloon."),
        StatusBit(1, "holding", "The setpoint was reached, and both valves are closed."),
        StatusBit(
            2,
            "interpolated",
            "The pressure rise is below 0.5 kPa (method membrane: 0.1 kPa): the force is only approximate.",
        ),
        StatusBit(
            3,
            "out_of_range",
            "ΔP_i is outside 4.95–11.45 kPa, the balloon may be pressed flat, the model has no solution, or "
            "the calibrated force is not plausible: no force is available.",
        ),
        StatusBit(
            4,
            "force_high_alarm",
            "The force is above the force limit, or the balloon may be pressed flat.",
        ),
        StatusBit(5, "stale_or_lost", "The last sample is stale, or the link to the rig is lost."),
        StatusBit(6, "simulated", "The values come from a simulation or a replay, not from a real rig."),
        StatusBit(7, "force_valid", "The force is valid (positive logic: 1 means valid)."),
    )
)

STATES = Enumeration(
    {0: "boot", 1: "vented", 2: "inflating", 3: "settling", 4: "holding", 5: "venting", 6: "tripped"}
)
REJECT_REASONS = Enumeration(
    {
        0: "none",
        1: "state",
        2: "fault_latched",
        3: "lease",
        4: "write_protect",
        5: "cause_persists",
        6: "link_lost",
        7: "not_zeroed",
        8: "in_contact",
        9: "implausible",
        10: "unknown_firmware",
    }
)
MODES = Enumeration({0: "vent", 1: "hold"})
PROOF_TESTS = Enumeration({0: "allowed", 1: "forbidden"})
HOLDERS = Enumeration({0: "none", 1: "modbus_tcp", 2: "modbus_rtu", 3: "can", 4: "web", 5: "modbus_tls"})
COMMANDS = Enumeration(
    {
        0: "none",
        1: "zero_pressure",
        2: "clear_faults",
        3: "self_test",
        4: "restore_zero",
        5: "new_balloon",
        6: "reset_force_extremes",
    }
)
ANSWERS = Enumeration({0: "idle", 1: "busy", 2: "done", 3: "failed"})
FIRMWARE_ORIGINS = Enumeration({0: "not_reported", 1: "current", 2: "other_version", 3: "unknown"})
SIGNATURES = Enumeration({0: "unsigned", 1: "signed", 2: "altered", 3: "unknown_key", 4: "no_file"})
AMBIENT_SOURCES = Enumeration({0: "configured", 1: "measured"})
METHODS = Enumeration(
    {
        0: "energetic",
        1: "lulevich",
        2: "shanahan",
        3: "membrane",
        256: "energetic_calibrated",
        257: "lulevich_calibrated",
        258: "shanahan_calibrated",
        259: "membrane_calibrated",
    }
)
#: Codes up to 15 come from the board, codes from 32 from the host (`instrument/core/faults.py`).
FAULTS = Enumeration(
    {
        0: "none",
        1: "sensor",
        2: "sensor_frozen",
        3: "supply_voltage",
        4: "overpressure",
        5: "burst",
        6: "limit_point",
        7: "no_rise",
        8: "inlet_open",
        9: "vent_shut",
        10: "occlusion",
        11: "leak",
        12: "setpoint_timeout",
        13: "host_silent",
        14: "watchdog",
        32: "lease_expired",
        33: "board_reset",
        34: "link_lost",
        35: "pressure_limit",
        36: "sensor_limit",
        37: "board_unresponsive",
        38: "disagreement",
        39: "not_vented",
        40: "force_limit",
        41: "can_master_lost",
    }
)
