"""Commissioning of one instrument: firmware, calibration, examination of the rig."""
