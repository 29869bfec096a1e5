"""Event log: requests to the instrument and their results, as records in a hash chain."""
