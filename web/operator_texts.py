"""Texts for the operator at the web page, which name the buttons and fields of the page.

`registers/advice.py` contains the complete advice for all buses. The page shows the advice for faults in the
words of the page.
"""

from __future__ import annotations

from collections.abc import Mapping

#: Words of the advice that name registers or commands, and the words for the page, which has buttons instead.
_PAGE_WORDS: Mapping[str, str] = {
    "Then clear": "Then press Clear faults",
    "Clear when": "Press Clear faults when",
    "clear, vent (mode 0), then hold (mode 1)": "press Clear faults, press VENT, then press Inflate",
    "send command 5 (pneuforce new-balloon) with its number": "enter its number and press New balloon",
    "force limit (register 514)": "force alarm limit",
    "by itself after 2 s by default": "by itself within about 2 s",
    "out_of_range": "out of range",
    "Copy of bit 27": "Copy of failure",
}


def in_page_words(advice: str) -> str:
    """Return a text of `registers/advice.py` with the names of the buttons and fields of the page."""
    for words, page_words in _PAGE_WORDS.items():
        advice = advice.replace(words, page_words)
    return advice


#: Name of each fault in words, by fault code.
FAULT_TITLES: Mapping[int, str] = {
    1: "pressure sensor failed",
    2: "pressure sensor frozen",
    3: "supply voltage out of range",
    4: "overpressure",
    5: "burst",
    6: "balloon past its limit point",
    7: "no gas flows in",
    8: "pressure rises while vented",
    9: "vent valve stuck",
    10: "tube blocked",
    11: "leak",
    12: "setpoint not reached",
    13: "host process was silent",
    14: "watchdog restarted the board",
    32: "lease expired",
    33: "board restarted",
    34: "samples from the rig lost",
    35: "pressure out of range",
    36: "sensor signal out of range",
    37: "board does not respond",
    38: "board does not hold",
    39: "board does not vent",
    40: "force limit exceeded",
    41: "CANopen master silent",
}

#: What each status bit asks of an operator; empty if nothing. A bit that a fault sets asks nothing, because
#: the page shows the advice for the fault. The page replaces {quantity} by the value of the state.
STATUS_ACTIONS: Mapping[str, str] = {
    "in_contact": "",
    "inflating": "Do not touch the balloon yet.",
    "holding": "",
    "vented": "",
    "interpolated": "Below {force_lower_range_limit_n} N: touch only, not a measurement.",
    "out_of_range": "No force: the pressure is outside the range of the model. Assume the highest force.",
    "force_high_alarm": "Back off.",
    "setpoint_not_reached": "",
    "stale": "No force: no current samples. Assume the highest force.",
    "link_lost": "Check the cable and the power supply of the rig.",
    "sensor_fault": "",
    "overpressure": "",
    "leak": "",
    "burst": "",
    "lease_expired": "",
    "simulated": "",
    "not_zeroed": "Press Clear faults if there are faults. Keep the rig vented: the zero is taken when "
    "the pressure is steady.",
    "write_protect": "",
    "board_watchdog": "",
    "can_down": "Check the CAN bus and its adapter. The other buses work.",
    "inlet_fault": "",
    "vent_fault": "",
    "board_reset": "",
    "baseline_old": "Lift off for a moment. If this message stays, vent and inflate again.",
    "maintenance_required": "Check the instrument soon.",
    "out_of_specification": "",
    "function_check": "",
    "failure": "",
    "calibrated": "",
    "proof_test_overdue": "A blocked tube might be undetected. Lift off for 5 s.",
    "force_high_alarm_2": "Back off.",
    "any_failure": "",
}

#: Text for each cause of the status bit `maintenance_required`.
MAINTENANCE_TEXTS: Mapping[str, str] = {
    "leak": "The balloon leaks slowly. End the measurement, and check the balloon and the tube.",
    "can_down": "The CAN bus does not work. The other buses work.",
    "clock_inaccurate": "The clock of the board is inaccurate. If this stays for 1 min, replace the board.",
    "event_log_failed": "The event log cannot be written. Check the disk of the instrument.",
    "recording_failed": "The last recording failed. Check the disk of the instrument, and record again.",
    "certificate_expiring": "A certificate, or the list of revoked certificates, expires soon. Replace it.",
    "ambient_missing": "No other program writes the ambient pressure, which the configuration requires.",
    "firmware_unknown": "The firmware of the board is not a released firmware. Install it again.",
    "tube_unproven": "The tube was blocked: look at the balloon. Hold for 15 s without a contact to end this "
    "message.",
}

#: Text for each reject reason. The words are those of the buttons of the page.
REJECT_TEXTS: Mapping[str, str] = {
    "none": "Accepted.",
    "state": "Not possible in this state. Press VENT, set a setpoint, then inflate.",
    "fault_latched": "A fault is latched. Remove its cause, press Clear faults, then press VENT.",
    "lease": "Another client has the lease, or the configuration requires a lease.",
    "write_protect": "The configuration disables writing. VENT works.",
    "cause_persists": "The cause of the fault is still present. See the list of faults.",
    "link_lost": "No samples from the rig. Check its cable and its power supply.",
    "not_zeroed": "No zero yet. Press VENT, and wait until the pressure is steady.",
    "in_contact": "Not possible during a contact. Lift off, and wait.",
    "implausible": "The value contradicts the configuration or the value before. Check the sensor.",
    "unknown_firmware": "The firmware of the board is not a released firmware. Install it again.",
}
