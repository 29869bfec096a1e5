"""Register map of the instrument, and the bus servers and documents that are derived from it."""
