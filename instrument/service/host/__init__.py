"""Event loop of the host: it connects the rig, the instrument and the output channels."""
