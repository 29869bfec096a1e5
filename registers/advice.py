"""What each fault, status bit, refusal and state means to a person at the rig, and what to do about it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from registers.codes import STATUS


class Advice(NamedTuple):
    """What has happened, and what to do: empty where nothing is to be done."""

    what: str
    do: str


_INFLATED = "Do not pull the balloon out: it may be inflated. Press the stop switch, which cuts both coils. "

#: By the code of register 778. "Clear" is the command of docs/rules.md; it moves no valve.
FAULT_ADVICE: Mapping[int, Advice] = {
    0: Advice("No fault is latched.", ""),
    1: Advice(
        "The pressure sensor is open or short: it reads below 1 % or above 98 % of its supply. Pressure and "
        "force are not known.",
        "Look at the sensor, its cable, its 5 V and the 100 kΩ from A0 to ground; then clear.",
    ),
    2: Advice(
        "The sensor's reading stood still for 0.2 s while a valve was open that must move it.",
        "Look at the sensor and its cable, and for a pinched tube before the sensor; then clear.",
    ),
    3: Advice(
        "The 5 V of board and sensor were outside 4.75–5.25 V.",
        "Take another USB port or cable; give the relays' coils a supply of their own; then clear.",
    ),
    4: Advice(
        "A pressure limit was passed: 0.5 kPa above the setpoint or 12.5 kPa while filling, "
        "contact_limit_kpa while held, 25 kPa always.",
        "Back off. Was it a push? Push less, or raise contact_limit_kpa. Was it none? Look at the "
        "regulator, and at an inlet valve that does not shut. Then clear.",
    ),
    5: Advice(
        "The balloon lost half its pressure within 0.1 s: it has burst, or its joint or a valve has opened.",
        "Look at the balloon. Burst: fit a new one (command 5, its number). Whole: look at its joint and the "
        "vent valve; one that was pressed while it was filled reads so, too. Then clear.",
    ),
    6: Advice(
        "The pressure fell while gas came in: the balloon is past its limit point, where it grows without "
        "taking more pressure, or it leaks badly.",
        "Look at the balloon, and fit a new one where it is harmed (command 5, its number); clear; take a "
        "lower setpoint.",
    ),
    7: Advice(
        "The inlet was open and the pressure did not rise: no gas comes.",
        "Look at the gas supply and its regulator, the orifice, the inlet valve and its relay; then clear.",
    ),
    8: Advice(
        "The pressure rose while the rig was vented: the inlet valve does not shut.",
        "Shut off the gas; look at the inlet valve and its relay. Clear when the rig is vented.",
    ),
    9: Advice(
        "The vent was opened and the pressure did not fall for 3 s: the vent valve is stuck.",
        _INFLATED + "Look at the vent valve and its relay. Clear when the rig is vented.",
    ),
    10: Advice(
        "The pressure moved in less than 60 % of the time that tubes and balloon take: the tube is occluded, "
        "and the balloon may be inflated though the pressure reads zero.",
        _INFLATED + "Look for a kinked tube; a regulator that is far too high reads so, too. Then clear.",
    ),
    11: Advice(
        "The held pressure leaked away again after three top-ups in ten minutes.",
        "Look at the balloon, and at its joints with soap water; then clear.",
    ),
    12: Advice(
        "The setpoint was not reached in 15 s or 20 actions of the valves.",
        "Look for a hole, a valve that leaks, an orifice that is too small; then clear.",
    ),
    13: Advice(
        "The board heard nothing of this program for so long that it vented by itself (2 s by default).",
        "Was the program killed, the machine busy, the cable out? See to that; then clear.",
    ),
    14: Advice(
        "The board restarted by itself: its watchdog, or a supply that fell too low.",
        "Look at the board's supply; give the relays' coils one of their own; then clear. Again and again? "
        "Flash the board's program anew: pneuforce flash.",
    ),
    32: Advice(
        "Whoever held the lease did not renew it in time, so nobody was in command.",
        "Find out why that program was late, stopped or cut off; then clear.",
    ),
    33: Advice(
        "The board restarted, or another one was plugged in.",
        "Look at its supply and RESET, and for a program that opens its port; then clear.",
    ),
    34: Advice(
        "No sample came from the rig for more than 0.25 s, or its port went away.",
        "Look at the cable and the board's power, and whether this machine is overloaded; clear when samples "
        "come again.",
    ),
    35: Advice(
        "The pressure passed contact_limit_kpa or 25 kPa, or fell below −5 kPa, by the host's own look.",
        "Back off. Was it a push? Push less, or raise contact_limit_kpa. Was it none? Look at the inlet "
        "valve and the regulator. Then clear.",
    ),
    36: Advice(
        "The sensor or its supply was out of span, by the host's own look.",
        "Look at the sensor, its cable, its 5 V and the 100 kΩ from A0 to ground; then clear.",
    ),
    37: Advice(
        "The board's clock stands still: its program hangs.",
        "Unplug the board, which vents the rig, and plug it in again; then clear. Again and again? Flash the "
        "board's program anew: pneuforce flash.",
    ),
    38: Advice(
        "The board was told to hold, and for a second did not: most likely it has restarted.",
        "Look at its supply and RESET, and for a program that opens its port; then clear.",
    ),
    39: Advice(
        "The board was told to vent, and for a second did not.",
        _INFLATED + "Look at the cable and at the board's program (pneuforce flash); then clear.",
    ),
    40: Advice(
        "The force passed the force limit, and vent_on_force_limit is configured.",
        "Back off; is the limit (register 514) the one that you want? Then clear.",
    ),
    41: Advice(
        "The CANopen master, whose heartbeat is watched, was not heard in time.",
        "Look at the master and at the bus; clear when its heartbeat is back.",
    ),
}

_BACK_OFF = "No force: assume the highest, and stop moving. "

#: What to do while a status bit is set; what it says stands beside the bit in codes.py.
_WHILE: Mapping[str, str] = {
    "in_contact": "Write no new setpoint now: it would wait for the end of the contact.",
    "inflating": "Wait, and touch nothing: a contact now gives no force.",
    "holding": "",
    "vented": "",
    "interpolated": "Take the force for a sign of touch below register 28, not for a figure.",
    "out_of_range": "Assume the highest force. Choose a setpoint so that ΔP_i is within 4.95–11.45 kPa.",
    "force_limit": "Stop pushing, back off.",
    "setpoint_not_reached": "Look at supply and leaks; clear; try again.",
    "stale": _BACK_OFF + "Look at the link to the rig, and whether this machine is overloaded.",
    "link_lost": _BACK_OFF + "The rig trips. Look at cable and power; then clear.",
    "sensor_fault": "The rig has vented: look at the sensor and its cable; then clear.",
    "overpressure": "The rig has vented: back off. Was the push harder than contact_limit_kpa? Then clear.",
    "leak": "The rig has vented: look at the balloon and its joints; then clear.",
    "burst": "The rig has vented: look at the balloon; the fault (register 778) says more; then clear.",
    "lease_expired": "The program that held the lease was late: find out why; then clear.",
    "simulated": "A machine must refuse to start on it.",
    "not_zeroed": "Vent and wait: it is zeroed by itself when steady, or by command 1.",
    "write_lock": "Measuring goes on; unlock writes in the configuration.",
    "board_watchdog": "Look at the board's supply; then clear.",
    "can_down": "Look at the bus and its adapter; the other buses go on.",
    "inlet_fault": "Look at the gas supply and the inlet valve; then clear.",
    "vent_fault": _INFLATED + "Look at the vent valve and the tube.",
    "board_reset": "Why did the board restart? Then clear.",
    "baseline_old": "Let go for a moment, so that the baseline is renewed.",
    "maintenance": "A slow leak, CAN, the board's clock, or the disk of event log and recording: the "
    "program's own log names which.",
    "out_of_specification": "See out_of_range.",
    "function_check": "Vented, or on the way: no force until the balloon is held.",
    "failure": "Stop. The fault (register 778) says what to do.",
    "calibrated": "",
    "any_failure": "See failure: this is for a program that takes one bit only.",
}

STATUS_ADVICE: Mapping[str, Advice] = {bit.name: Advice(bit.doc, _WHILE[bit.name]) for bit in STATUS.bits}

_AFTER_A_FAULT = "A fault has vented the rig: remove its cause, clear, vent (mode 0), then hold (mode 1)."

REFUSAL_WORDS: Mapping[str, str] = {
    "none": "Accepted.",
    "state": "Not in this state or order, or a command is still busy: vent (mode 0), then a setpoint, then "
    "hold (mode 1); or wait.",
    "fault_latched": _AFTER_A_FAULT,
    "lease": "Somebody else holds the lease, or the configuration demands one: wait until it is given back, "
    "or take one.",
    "write_lock": "The configuration locks writes: unlock them there. A vent is never locked.",
    "cause_persists": "The cause of the fault is not gone: the fault (register 778) says what to look at.",
    "link_lost": "No samples come from the rig: look at its cable and its power.",
    "not_zeroed": "The sensor has no zero: vent and wait; taken when vented and steady within ±1.3 kPa.",
    "in_contact": "Not while the balloon is pressed, nor while a vent waits for that to end: let go; wait.",
}

STATE_WORDS: Mapping[str, str] = {
    "boot": "The board is starting, or none has answered yet.",
    "vented": "Vented, and verified so: below 0.3 kPa for 0.5 s.",
    "inflating": "Gas flows in until the setpoint is near.",
    "settling": "The pressure is brought to within 0.1 kPa of the setpoint.",
    "holding": "Both valves are locked at the setpoint: force is measured.",
    "venting": "The balloon empties; that is not verified yet.",
    "tripped": _AFTER_A_FAULT,
}
