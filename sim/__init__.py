"""Simulated rig: balloon, pneumatic circuit, sensor and board, connected to the host by a serial line."""
