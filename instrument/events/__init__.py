"""The event log: what was asked of the instrument and what became of it, each record sealed onto the last."""
