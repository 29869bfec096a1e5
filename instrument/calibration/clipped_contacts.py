"""Contacts of a force calibration whose pressure is clipped: equal pressures for different forces."""

from __future__ import annotations

import numpy as np

from pneuforce.instrument.calibration.contacts import CalibrationContacts

#: Contacts with the highest pressure. Two can be equal by chance.
MIN_CLIPPED = 3
#: Difference of their forces, relative to the largest. The pressures of equal forces differ by noise only.
MIN_FORCE_CHANGE = 0.1
DIGITS = 6  #: decimal digits of the pressures [kPa] that are compared


def clipped_contacts_warning(contacts: CalibrationContacts) -> str:
    """Return a warning if different forces have the same highest pressure, otherwise ""."""
    final_kpa = (contacts.baseline_kpa + contacts.rise_kpa).round(DIGITS)
    highest_kpa = final_kpa.max()
    forces_n = contacts.force_n[final_kpa == highest_kpa]
    if len(forces_n) < MIN_CLIPPED or not np.ptp(forces_n) > MIN_FORCE_CHANGE * np.max(forces_n):
        return ""
    return (
        f"{len(forces_n)} contacts with forces from {forces_n.min():.2f} to {forces_n.max():.2f} N have the "
        f"same pressure of {highest_kpa:g} kPa, so the pressure is probably clipped: remove these contacts, "
        "and use a pressure sensor with a larger range, or press less"
    )
