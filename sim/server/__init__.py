"""Process that runs the simulated rig and its control port."""
