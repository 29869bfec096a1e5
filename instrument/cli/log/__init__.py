"""Commands for the event log: show and verify."""
