"""Commands for the simulated rig: run, fault, press, truth."""
