"""Long-running processes and servers of the instrument."""
