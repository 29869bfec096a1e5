"""What each code and each bit is called: the enumerations and bit fields of every face."""

from __future__ import annotations

from registers.field import Bit, Bits, Values

STATUS = Bits(
    (
        Bit(0, "in_contact", "The balloon is pressed."),
        Bit(1, "inflating", "Inflating or settling."),
        Bit(2, "holding", "Holding: both valves locked at the setpoint."),
        Bit(3, "vented", "Vented, and verified so: below 0.3 kPa for 0.5 s."),
        Bit(4, "interpolated", "Rise below 0.5 kPa: the force is interpolated to zero."),
        Bit(
            5, "out_of_range", "ΔP_i outside 4.95–11.45 kPa, or the model has no answer: force not available."
        ),
        Bit(6, "force_limit", "Force above the force limit (register 514)."),
        Bit(7, "setpoint_not_reached", "The setpoint was not reached in time.", latches=True),
        Bit(8, "stale", "Sample older than 100 ms: values not available."),
        Bit(9, "link_lost", "No frame from the rig for more than 250 ms."),
        Bit(10, "sensor_fault", "Pressure sensor open, short or stuck.", latches=True),
        Bit(11, "overpressure", "A pressure limit was exceeded.", latches=True),
        Bit(12, "leak", "The locked pressure falls steadily without contact.", latches=True),
        Bit(13, "burst", "Balloon burst, or past its limit point.", latches=True),
        Bit(14, "lease_expired", "A lease ran out.", latches=True),
        Bit(15, "simulated", "The source is not a real rig."),
        Bit(16, "not_zeroed", "The pressure sensor has no zero yet: no inflation."),
        Bit(17, "write_lock", "Writes are locked by the configuration."),
        Bit(18, "board_watchdog", "The board restarted by its watchdog or a brown-out.", latches=True),
        Bit(19, "can_down", "The CAN interface is down."),
        Bit(20, "inlet_fault", "Inlet valve or supply: no rise, or stuck open.", latches=True),
        Bit(
            21,
            "vent_fault",
            "Vent valve stuck, or the tube is occluded: the balloon may be inflated.",
            latches=True,
        ),
        Bit(22, "board_reset", "The board restarted.", latches=True),
        Bit(23, "baseline_old", "The baseline is old or drifting."),
        Bit(24, "maintenance", "Maintenance required (NAMUR NE 107): look at it soon."),
        Bit(25, "out_of_specification", "Out of specification (NAMUR NE 107)."),
        Bit(26, "function_check", "Function check (NAMUR NE 107): nothing is held, nothing has failed."),
        Bit(27, "failure", "Failure (NAMUR NE 107): a fault is latched, or samples are stale."),
        Bit(28, "calibrated", "The force carries a force calibration."),
        Bit(31, "any_failure", "Any failure is active."),
    )
)

STATUS_LOW = Bits(tuple(bit for bit in STATUS.bits if bit.number < 16))
STATUS_HIGH = Bits(tuple(Bit(b.number - 16, b.name, b.doc, b.latches) for b in STATUS.bits if b.number >= 16))

CONDENSED = Bits(
    (
        Bit(0, "in_contact", "The balloon is pressed."),
        Bit(1, "holding", "Holding: both valves locked."),
        Bit(2, "interpolated", "The force is interpolated (rise below 0.5 kPa)."),
        Bit(3, "out_of_range", "ΔP_i outside 4.95–11.45 kPa."),
        Bit(4, "force_limit", "Force above the force limit."),
        Bit(5, "stale_or_lost", "Sample stale or rig link lost."),
        Bit(6, "simulated", "The source is not a real rig."),
        Bit(7, "force_valid", "The force is a number that may be used (positive logic)."),
    )
)

STATES = Values(
    {0: "boot", 1: "vented", 2: "inflating", 3: "settling", 4: "holding", 5: "venting", 6: "tripped"}
)
REFUSALS = Values(
    {
        0: "none",
        1: "state",
        2: "fault_latched",
        3: "lease",
        4: "write_lock",
        5: "cause_persists",
        6: "link_lost",
        7: "not_zeroed",
        8: "in_contact",
    }
)
MODES = Values({0: "vent", 1: "hold"})
HOLDERS = Values({0: "none", 1: "modbus_tcp", 2: "modbus_rtu", 3: "can", 4: "page"})
COMMANDS = Values(
    {
        0: "none",
        1: "zero_pressure",
        2: "clear_faults",
        3: "self_test",
        4: "undo_zero",
        5: "new_balloon",
    }
)
ANSWERS = Values({0: "idle", 1: "busy", 2: "done", 3: "failed"})
METHODS = Values(
    {
        0: "energetic",
        1: "lulevich",
        2: "shanahan",
        256: "energetic_calibrated",
        257: "lulevich_calibrated",
        258: "shanahan_calibrated",
    }
)
#: As `instrument/faults.py` and the board have them: up to 15 the board's, from 32 on the host's.
FAULTS = Values(
    {
        0: "none",
        1: "sensor",
        2: "stuck",
        3: "supply_voltage",
        4: "overpressure",
        5: "burst",
        6: "limit_point",
        7: "no_rise",
        8: "inlet_open",
        9: "vent_shut",
        10: "occlusion",
        11: "leak",
        12: "timeout",
        13: "host_silent",
        14: "watchdog",
        32: "lease_expired",
        33: "board_reset",
        34: "link_lost",
        35: "pressure_limit",
        36: "sensor_limit",
        37: "sensor_stuck",
        38: "disagreement",
        39: "not_vented",
        40: "force_limit",
        41: "can_master_lost",
    }
)
