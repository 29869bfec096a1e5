"""The simulated world: balloon, pneumatics, sensor and board at the far end of a serial cable."""
