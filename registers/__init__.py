"""The instrument's face: one declared register map, and the buses and documents derived from it."""
