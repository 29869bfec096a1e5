"""Commands for the steps of a calibration."""
