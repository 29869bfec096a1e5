"""Advice for users: the meaning of each fault, status bit, reject reason and state, and the remedy."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from pneuforce.registers.codes import STATUS


class Advice(NamedTuple):
    """Meaning of a code or bit, and the action that it requires."""

    what: str  #: event or condition
    do: str  #: required action; empty if no action is required


_INFLATED = "Do not pull the balloon out: it may be inflated. Press the stop switch, which cuts both coils. "

#: Advice by fault code (register 778). "Clear" is the command `clear_faults`, which moves no valve.
FAULT_ADVICE: Mapping[int, Advice] = {
    0: Advice("No fault is latched.", ""),
    1: Advice(
        "The pressure sensor is open or short: it reads below 1 % or above 98 % of its supply. Pressure and "
        "force are unknown.",
        "Check the sensor, its cable, its 5 V supply and the 100 kΩ resistor from A0 to ground. Then clear.",
    ),
    2: Advice(
        "The sensor's reading did not change for 0.2 s although an open valve must change the pressure.",
        "Check the sensor and its cable. Check for a pinched tube before the sensor. Then clear.",
    ),
    3: Advice(
        "The 5 V supply of board and sensor was outside 4.75–5.25 V.",
        "Use another USB port or cable. Give the relay coils a separate supply. Then clear.",
    ),
    4: Advice(
        "A pressure limit was exceeded: 0.5 kPa above the setpoint or 12.5 kPa while filling, "
        "contact_limit_kpa while holding, 25 kPa always.",
        "Back off. If the balloon was pushed: push less, or raise contact_limit_kpa. If not: check the "
        "regulator, and check that the inlet valve closes. Then clear.",
    ),
    5: Advice(
        "The balloon lost half its pressure within 0.1 s: it has burst, or its joint or a valve has opened.",
        "Check the balloon. If it has burst, fit a new one (command 5 with its number). If not, check its "
        "joint and the vent valve. A balloon that is pressed while it is filled can cause the same reading. "
        "Then clear.",
    ),
    6: Advice(
        "The pressure fell while gas flowed in. The balloon is past its limit point, where it grows without "
        "more pressure, or it leaks badly.",
        "Check the balloon. If it is damaged, fit a new one (command 5 with its number). Clear, and use a "
        "lower setpoint.",
    ),
    7: Advice(
        "The inlet was open and the pressure did not rise: no gas flows in.",
        "Check the gas supply and its regulator, the orifice, the inlet valve and its relay. Then clear.",
    ),
    8: Advice(
        "The pressure rose while the rig was vented: the inlet valve does not close.",
        "Shut off the gas. Check the inlet valve and its relay. Clear when the rig is vented.",
    ),
    9: Advice(
        "The vent was opened and the pressure did not fall for 3 s: the vent valve is stuck.",
        _INFLATED + "Check the vent valve and its relay. Clear when the rig is vented.",
    ),
    10: Advice(
        "The pressure changed in less than 60 % of the time that tubes and balloon need: the tube is "
        "blocked. The balloon may be inflated although the pressure reads zero.",
        _INFLATED + "Check for a kinked tube. A regulator pressure that is far too high has the same effect. "
        "Then clear.",
    ),
    11: Advice(
        "The held pressure leaked away again after three top-ups in ten minutes.",
        "Check the balloon, and check its joints with soap water. Then clear.",
    ),
    12: Advice(
        "The setpoint was not reached in 15 s or 20 actions of the valves.",
        "Check for a hole, for a valve that leaks, and for an orifice that is too small. Then clear.",
    ),
    13: Advice(
        "The board received nothing from the host process for its time limit (2 s by default) and vented.",
        "Check whether the host process was stopped, the computer was overloaded or the cable was unplugged. "
        "Then clear.",
    ),
    14: Advice(
        "The board restarted without a command: because of its watchdog, or because its supply was too low.",
        "Check the supply of the board. Give the relay coils a separate supply. Then clear. If it happens "
        "again, install the board's program again: pneuforce flash.",
    ),
    32: Advice(
        "The holder of the lease did not renew it in time.",
        "Find out why that program was late, stopped or disconnected. Then clear.",
    ),
    33: Advice(
        "The board restarted, or another board was plugged in.",
        "Check the supply and the RESET line of the board. Check whether another program opens its port. "
        "Then clear.",
    ),
    34: Advice(
        "No sample came from the rig for more than 0.25 s, or its port disappeared.",
        "Check the cable, the power of the board and the load of this computer. Clear when samples arrive "
        "again.",
    ),
    35: Advice(
        "The host process measured a pressure above contact_limit_kpa or 25 kPa, or below −5 kPa.",
        "Back off. If the balloon was pushed: push less, or raise contact_limit_kpa. If not: check the inlet "
        "valve and the regulator. Then clear.",
    ),
    36: Advice(
        "The host process measured a sensor or supply voltage outside its limits.",
        "Check the sensor, its cable, its 5 V supply and the 100 kΩ resistor from A0 to ground. Then clear.",
    ),
    37: Advice(
        "The clock of the board has stopped: the program of the board hangs.",
        "Unplug the board, which vents the rig, and plug it in again. Then clear. If it happens again, "
        "install the board's program again: pneuforce flash.",
    ),
    38: Advice(
        "The board did not follow a hold command for 1 s. Most likely it has restarted.",
        "Check the supply and the RESET line of the board. Check whether another program opens its port. "
        "Then clear.",
    ),
    39: Advice(
        "The board did not follow a vent command for 1 s.",
        _INFLATED + "Check the cable and the board's program (pneuforce flash). Then clear.",
    ),
    40: Advice(
        "The force exceeded the force limit, and vent_on_force_limit is configured.",
        "Back off. Check that the force limit (register 514) has the value that you want. Then clear.",
    ),
    41: Advice(
        "The monitored heartbeat of the CANopen master did not arrive in time.",
        "Check the master and the bus. Clear when the heartbeat is back.",
    ),
}

_NO_FORCE = "No force is available: assume the highest force, and stop moving. "

#: Action that each status bit requires while it is set. The meaning of each bit is in codes.py.
_STATUS_ACTIONS: Mapping[str, str] = {
    "in_contact": "Do not write a new setpoint now: it takes effect only when the contact ends.",
    "inflating": "Wait, and touch nothing: no force is measured in a contact that starts now.",
    "holding": "",
    "vented": "",
    "interpolated": "Below the force in register 28, use the force as a sign of contact, not as a number.",
    "out_of_range": "Assume the highest force. Choose a setpoint that gives a ΔP_i of 4.95–11.45 kPa.",
    "force_high_alarm": "Stop pushing, and back off.",
    "setpoint_not_reached": "Check the supply, and check for leaks. Clear, and try again.",
    "stale": _NO_FORCE + "Check the link to the rig and the load of this computer.",
    "link_lost": _NO_FORCE + "The rig trips. Check the cable and the power. Then clear.",
    "sensor_fault": "The rig has vented. Check the sensor and its cable. Then clear.",
    "overpressure": "The rig has vented. Back off. Check whether the push was harder than contact_limit_kpa. "
    "Then clear.",
    "leak": "The rig has vented. Check the balloon and its joints. Then clear.",
    "burst": "The rig has vented. Check the balloon. The fault (register 778) gives details. Then clear.",
    "lease_expired": "Find out why the program that held the lease was late. Then clear.",
    "simulated": "A machine must not start with these values.",
    "not_zeroed": "Vent and wait: the zero is taken automatically when the pressure is steady. Command 1 "
    "takes it, too.",
    "write_protect": "Measuring continues. To write, enable writing in the configuration.",
    "board_watchdog": "Check the supply of the board. Then clear.",
    "can_down": "Check the bus and its adapter. The other buses continue to work.",
    "inlet_fault": "Check the gas supply and the inlet valve. Then clear.",
    "vent_fault": _INFLATED + "Check the vent valve and the tube.",
    "board_reset": "Find out why the board restarted. Then clear.",
    "baseline_old": "End the contact for a moment, so that the baseline is measured again.",
    "maintenance_required": "The cause is a slow leak, CAN, the board's clock, or the disk of the event log "
    "or recording. The log of the host process names the cause.",
    "out_of_specification": "See out_of_range.",
    "function_check": "The balloon is vented or not yet held. No force is available until it is held: wait.",
    "failure": "Stop. Follow the advice for the fault (register 778).",
    "calibrated": "",
    "any_failure": "See failure. This bit is for programs that test one bit only.",
}

STATUS_ADVICE: Mapping[str, Advice] = {
    bit.name: Advice(bit.doc, _STATUS_ACTIONS[bit.name]) for bit in STATUS.bits
}

_AFTER_A_FAULT = "A fault has vented the rig: remove its cause, clear, vent (mode 0), then hold (mode 1)."

REJECT_REASON_ADVICE: Mapping[str, str] = {
    "none": "Accepted.",
    "state": "Not allowed in this state or order, or a command is still running. Vent (mode 0), write a "
    "setpoint, then hold (mode 1); or wait.",
    "fault_latched": _AFTER_A_FAULT,
    "lease": "Another peer holds the lease, or the configuration requires a lease. Wait until the lease is "
    "free, or take a lease.",
    "write_protect": "The configuration disables writing: enable it there. A vent is always accepted.",
    "cause_persists": "The cause of the fault is still present: see the advice for the fault (register 778).",
    "link_lost": "No samples come from the rig: check its cable and its power.",
    "not_zeroed": "The sensor has no zero adjustment: vent and wait. The zero is taken when the rig is "
    "vented and the pressure is steady within ±1.3 kPa.",
    "in_contact": "Not allowed during contact, or while a vent waits for the end of the contact: end the "
    "contact, and wait.",
}

STATE_DESCRIPTIONS: Mapping[str, str] = {
    "boot": "The board is starting, or no board has answered yet.",
    "vented": "The balloon is empty: the pressure was below 0.3 kPa for 0.5 s.",
    "inflating": "Gas flows in until the pressure is near the setpoint.",
    "settling": "The board brings the pressure to within 0.1 kPa of the setpoint.",
    "holding": "Both valves are closed after the setpoint was reached: the force is measured.",
    "venting": "The balloon empties. It is not yet verified to be empty.",
    "tripped": _AFTER_A_FAULT,
}
