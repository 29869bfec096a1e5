"""Signatures of the configuration and the calibration, and the keys that an administrator trusts."""
