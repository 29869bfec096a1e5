"""Serial lines of the simulated rig: pseudo-terminal, noise and proxies."""
