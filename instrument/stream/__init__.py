"""Entries that the host process sends to recorders and to the web process."""
