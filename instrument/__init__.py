"""The instrument: rig frames in, contact force with its uncertainty out."""
