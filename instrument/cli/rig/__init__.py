"""Commands for a rig without a running instrument: doctor and flash."""
