"""Recordings: all inputs of an instrument with their times, and the resulting measurements."""
