"""Studies on the simulated rig: accuracy of the force, validation, reference contacts."""
