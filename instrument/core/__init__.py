"""State, rules and requests of the instrument; no I/O, time is an argument."""
