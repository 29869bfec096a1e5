"""The tape: all that goes into the instrument, in order and with its time, and what came of it."""
