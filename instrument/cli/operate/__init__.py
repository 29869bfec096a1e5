"""Commands that operate a running instrument: status, vent, set, hold, release, clear, zero."""
