"""Commands for the event log: show, verify and copy."""
