"""Advice for users: the meaning of each fault, status bit, reject reason and state, and the remedy."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from pneuforce.registers.codes import MAINTENANCE_CAUSES, STATUS


class Advice(NamedTuple):
    """Meaning of a code or bit, and the action that it requires."""

    what: str  #: event or condition
    do: str  #: required action; empty if no action is required


_INFLATED = (
    "Do not pull the balloon out: it may be inflated. Press the stop switch at the rig, which turns off the "
    "power of both valves. "
)

#: Advice by fault code (register 778). "Clear" is the command `clear_faults`, which moves no valve.
FAULT_ADVICE: Mapping[int, Advice] = {
    0: Advice("No fault is latched.", ""),
    1: Advice(
        "The pressure sensor is open or shorted: its signal is below 1 % or above 98 % of its supply "
        "voltage. Pressure and force are unknown.",
        "Check the sensor, its cable, its 5 V supply and the 100 kΩ resistor from A0 to ground. Then clear.",
    ),
    2: Advice(
        "The signal of the pressure sensor did not change for 0.2 s, although an open valve must change "
        "the pressure.",
        "Check the sensor and its cable. Check whether the tube of the sensor is pinched. Then clear.",
    ),
    3: Advice(
        "The 5 V supply of board and sensor was outside 4.75–5.25 V.",
        "Use another USB port or cable. Give the relay coils a separate supply. On a new board, measure the "
        "reference voltage (docs/firmware.md). Then clear.",
    ),
    4: Advice(
        "The pressure exceeded a limit: 0.5 kPa above the setpoint or 12.5 kPa while filling, "
        "the pressure limit (18 kPa by default) while holding, 25 kPa always.",
        "Back off. If the balloon was pressed, press less. Otherwise check the regulator and the inlet "
        "valve. Then clear. An administrator can raise the pressure limit.",
    ),
    5: Advice(
        "The pressure fell by half within 0.1 s: the balloon has burst, or its joint or a valve has opened.",
        "Check the balloon, the joint and the vent valve. After a change of the balloon, send command 5 "
        "(pneuforce new-balloon) with its number. Then clear. A contact during inflation can be the cause.",
    ),
    6: Advice(
        "The pressure fell while gas flowed in: the balloon leaks badly, or is past its limit point, at "
        "which a balloon grows although its pressure falls.",
        "Check the balloon. After a change of the balloon, send command 5 (pneuforce new-balloon) with its "
        "number. Then clear, and use a lower setpoint.",
    ),
    7: Advice(
        "The inlet valve was open, but the pressure did not rise: no gas flows in, or it flows out at once.",
        "Check the gas supply and its regulator, the orifice, the inlet valve and its relay. Check that the "
        "vent valve closes (valve, coil, relay), and that balloon and joint are intact. Then clear.",
    ),
    8: Advice(
        "The pressure rose while the rig was vented: the inlet valve does not close, or something presses "
        "the balloon.",
        "If a kinked tube was freed just before, the gas of the balloon was the cause: wait. Otherwise shut "
        "off the gas, and check the inlet valve and its relay. Clear when the rig is vented.",
    ),
    9: Advice(
        "The vent valve was opened, but the pressure did not fall for 3 s: the vent valve is stuck.",
        _INFLATED + "Check the vent valve and its relay. Clear when the pressure "
        "has been below 0.3 kPa for 0.5 s.",
    ),
    10: Advice(
        "The tube is blocked: the pressure changed in less than 60 % of the expected time, or too much in "
        "two proof tests. The balloon may be inflated although the measured pressure is zero.",
        _INFLATED + "Check whether the tube is kinked, and whether the supply pressure is far too high. Then "
        "clear. If the tube is free, a contact during inflation can be the cause: inflate without a contact.",
    ),
    11: Advice(
        "The pressure fell again after three top-ups within ten minutes: the balloon or a joint leaks.",
        "Check the balloon, and check the joints with soapy water. Then clear.",
    ),
    12: Advice(
        "The setpoint was not reached within 15 s or 20 actions of the valves.",
        "Check for a hole, for a valve that leaks, and for an orifice that is too small. Then clear.",
    ),
    13: Advice(
        "The board received nothing from the host process within the time limit (2 s by default), and "
        "vented.",
        "Check whether the host process was stopped, the computer overloaded or the cable unplugged. Then "
        "clear.",
    ),
    14: Advice(
        "The board restarted without a command. The cause is its watchdog, or a supply voltage that was "
        "too low.",
        "Check the supply of the board. Give the relay coils a separate supply. Then clear. If the fault "
        "occurs again, install the firmware again (pneuforce flash).",
    ),
    32: Advice(
        "The client that holds the lease did not renew the lease in time.",
        "Find out why this client was late, stopped or disconnected. Then clear.",
    ),
    33: Advice(
        "The board restarted, or another board was plugged in.",
        "Check the supply and the RESET pin of the board, and whether another program opens its serial "
        "port. Then clear.",
    ),
    34: Advice(
        "No sample arrived from the rig for more than 0.25 s, or the serial port of the rig disappeared.",
        "Look at the balloon: without commands, the board vents it by itself after 2 s by default. "
        "Check the cable, the power of the board and the load of this computer. Clear when samples arrive "
        "again.",
    ),
    35: Advice(
        "The host process measured a pressure above the pressure limit (18 kPa by default, at most 25 kPa), "
        "or below −5 kPa.",
        "Back off. If the balloon was pressed, press less. Otherwise check the regulator and the inlet "
        "valve. Then clear. An administrator can raise the pressure limit.",
    ),
    36: Advice(
        "The host process measured a sensor voltage or a supply voltage outside its limits.",
        "Check the sensor, its cable, its 5 V supply and the 100 kΩ resistor from A0 to ground. Then clear.",
    ),
    37: Advice(
        "The clock of the board has stopped or is wrong: the firmware hangs, or the board is defective.",
        "Unplug the board, which vents the rig. Plug the board in again. Then clear. If the fault occurs "
        "again, install the firmware again (pneuforce flash).",
    ),
    38: Advice(
        "For 1 s, the board did not follow a hold command, or its state changed too often. The board has "
        "most likely restarted, or the computer was too busy to send its commands in time.",
        "Check the supply and the RESET pin of the board, whether another program opens its serial port, and "
        "whether other programs keep the computer busy. Then clear.",
    ),
    39: Advice(
        "The board did not follow a vent command for 1 s, or its state changed too often.",
        _INFLATED + "Check the cable. Install the firmware again (pneuforce flash). Then clear.",
    ),
    40: Advice(
        "The force exceeded the force limit, or the balloon may have been pressed flat, and the "
        "configuration requires a vent then.",
        "Back off. Check whether the force limit (register 514) is correct. Then clear.",
    ),
    41: Advice(
        "The monitored heartbeat of the CANopen master did not arrive in time.",
        "Check the master and the bus. Clear when the heartbeat arrives again.",
    ),
}

_NO_FORCE = (
    "No force is available: assume the highest force. A robot moves back to a safe distance, and stops "
    "there. A machine that cannot move back stops at once. "
)

#: Action that each status bit requires while it is set. The meaning of each bit is in codes.py.
_STATUS_ACTIONS: Mapping[str, str] = {
    "in_contact": "Do not write a new setpoint now: a new setpoint takes effect only after the contact.",
    "inflating": "Wait, and do not press the balloon: no force is measured in a contact that starts now.",
    "holding": "",
    "vented": "",
    "interpolated": "A force below the value of register 28 shows only that there is a contact: it is not a "
    "measurement.",
    "out_of_range": "Assume the highest force. If the force alarm is on, back off: the balloon may be "
    "pressed flat. Otherwise choose a setpoint for which ΔP_i is within 4.95–11.45 kPa. A force calibration "
    "must contain contacts at this setpoint.",
    "force_high_alarm": "Stop pushing, and back off.",
    "setpoint_not_reached": "Check the gas supply, and check the rig for leaks. Then clear, and inflate "
    "again.",
    "stale": _NO_FORCE + "Check the link to the rig and the load of this computer.",
    "link_lost": _NO_FORCE + "The rig trips. Check the cable and the power supply of the rig. Then clear.",
    "sensor_fault": "The rig has tripped. Check the sensor and its cable. Then clear.",
    "overpressure": "The rig has tripped. Back off. Check whether a contact raised the pressure above "
    "the pressure limit. Then clear.",
    "leak": "The rig has tripped. Check the balloon and its joints. Then clear.",
    "burst": "The rig has tripped. Check the balloon. The fault (register 778) gives details. Then clear.",
    "lease_expired": "Find out why the client that held the lease was late. Then clear.",
    "simulated": "Do not let a machine start with these values.",
    "not_zeroed": "Clear the faults, vent and wait: the zero is taken automatically when the board reports "
    "vented and the pressure is steady (span of 0.05 kPa for 0.5 s, within ±1.3 kPa). Command 1 also takes "
    "the zero.",
    "write_protect": "The measurement continues. To write values, set write_protect = false in the section "
    "[safety] of the configuration. A replay of a recording accepts no writes.",
    "board_watchdog": "Check the supply of the board. Then clear.",
    "can_down": "Check the CAN bus and its adapter. The other buses continue to work.",
    "inlet_fault": "Check the gas supply and the inlet valve. Then clear.",
    "vent_fault": _INFLATED + "Check the vent valve and the tube. Then clear.",
    "board_reset": "Find out why the board restarted. Then clear.",
    "baseline_old": "Interrupt the contact for a moment, so that the baseline pressure is measured again. If "
    "the force stays invalid, vent and inflate again. If the configuration sets reference_timeout_s, write "
    "register 518 periodically.",
    "maintenance_required": "Register 74 contains the causes. Remove them.",
    "out_of_specification": "See bit 5 (out_of_range).",
    "function_check": "No force is available now. If a proof test is in progress, wait for up to 5 s. "
    "Otherwise inflate the balloon, or wait until the setpoint is reached.",
    "proof_test_overdue": "A blocked tube might be undetected: the force might be too small. Retract from "
    "the tissue for 5 s, and write 546 := 0.",
    "failure": _NO_FORCE + "Follow the advice for the fault (register 778).",
    "calibrated": "",
    "force_high_alarm_2": "Stop pushing, and back off.",
    "any_failure": "See bit 27 (failure). This bit is for programs that can test only the sign of the "
    "status.",
}

STATUS_ADVICE: Mapping[str, Advice] = {
    bit.name: Advice(bit.doc, _STATUS_ACTIONS[bit.name]) for bit in STATUS.bits
}

_MAINTENANCE_ACTIONS: Mapping[str, str] = {
    "leak": "End the measurement, and examine the circuit: pneuforce doctor --inflate. A later minute "
    "without a leak ends this condition.",
    "can_down": "Check the CAN bus and its adapter.",
    "clock_inaccurate": "If the computer was overloaded, reduce its load: the condition then ends. Otherwise "
    "replace the board: its interlocks use the same clock.",
    "event_log_failed": "Check the disk: free space, rights of the folder, a damaged file (docs/events.md).",
    "recording_failed": "Check the disk. The next recording that starts ends this condition.",
    "certificate_expiring": "Replace certificate and key (pneuforce certificates), or the list. The log "
    "names the file.",
    "ambient_missing": "Write the ambient pressure periodically (register 556), or set "
    "ambient_required = false.",
    "firmware_unknown": "Install the firmware of the package: pneuforce flash.",
    "tube_unproven": "Look at the balloon, and check the tube. Then hold for at least 15 s without a "
    "contact: a proof test that passes ends this condition.",
}

#: Advice for each cause of the status bit `maintenance_required` (register 74).
MAINTENANCE_ADVICE: Mapping[str, Advice] = {
    bit.name: Advice(bit.doc, _MAINTENANCE_ACTIONS[bit.name]) for bit in MAINTENANCE_CAUSES.bits
}

#: Status bits that can be the reason for a missing force. The first bit is the most important.
NO_FORCE_REASONS = (
    "link_lost",
    "stale",
    "sensor_fault",
    "not_zeroed",
    "out_of_range",
    "baseline_old",
    "function_check",
    "failure",
)

_AFTER_A_FAULT = (
    "A fault has tripped the rig, and the instrument has commanded a vent: remove the cause of the fault, "
    "clear, vent (mode 0), then hold (mode 1)."
)

REJECT_REASON_ADVICE: Mapping[str, str] = {
    "none": "Accepted.",
    "state": "The request is not allowed in this state or in this order. A hold: no mode 0 was written since "
    "the start or the clear, this peer has not written mode 0 since its last hold, or no setpoint was "
    "written: vent (mode 0), write a setpoint, then hold (mode 1). A command: another command is running, "
    "the key is missing, the code is unknown, the rig is not vented or its pressure is not steady, or there "
    "is no previous zero. The reference pressure: vent and wait until status bit 3 is set.",
    "fault_latched": _AFTER_A_FAULT,
    "lease": "Another peer holds the lease: wait until the lease is free. Or the configuration requires a "
    "lease: take a lease.",
    "write_protect": "The configuration disables writing: enable writing in the configuration. Or this is a "
    "replay of a recording, which accepts no writes. A vent is always accepted.",
    "cause_persists": "The cause of the fault is still present: see the advice for the fault (register 778).",
    "link_lost": "No samples arrive from the rig: check the cable and the power supply of the rig.",
    "not_zeroed": "The sensor has no zero adjustment: vent and wait. The zero is taken when the rig is "
    "vented and the pressure is steady within ±1.3 kPa.",
    "in_contact": "The request is not allowed during a contact, or while the instrument waits for the end "
    "of a contact and then vents. End the contact, and wait.",
    "implausible": "The written ambient pressure differs by more than 6 kPa from circuit.ambient_kpa in the "
    "configuration, or by more than 1 kPa from the last written one. Write the absolute pressure at the "
    "instrument, not the pressure reduced to sea level. Check the barometer and the configuration.",
    "unknown_firmware": "The firmware is not a released firmware, and rig.require_released_firmware is true "
    "in the configuration. Install the firmware of this package (pneuforce flash).",
}

#: Meaning of each result of the comparison of the firmware with the released images (register 795).
FIRMWARE_ORIGIN_DESCRIPTIONS: Mapping[str, str] = {
    "not_reported": "No board has answered yet, or its firmware does not report its image.",
    "current": "The board has the firmware of the package on the instrument.",
    "other_version": "The board has a released firmware, but not that of the package on the instrument.",
    "unknown": "The image on the board is not a released image: it is a private build, or the flash is "
    "damaged. Install the firmware of the package (pneuforce flash).",
}

STATE_DESCRIPTIONS: Mapping[str, str] = {
    "boot": "The board is starting, or no board has answered yet.",
    "vented": "The board has measured less than 0.3 kPa for 0.5 s (without a zero: a steady pressure of less "
    "than 1.6 kPa). Look at the balloon.",
    "inflating": "Gas flows into the balloon until the pressure is near the setpoint.",
    "settling": "The board brings the pressure to within 0.1 kPa of the setpoint.",
    "holding": "The setpoint was reached, and both valves are closed: the force is measured.",
    "venting": "Gas flows out of the balloon. The balloon is not yet verified to be empty.",
    "tripped": _AFTER_A_FAULT,
}
