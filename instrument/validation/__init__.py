"""Validation by the method of the paper: comparison of recorded contacts with a reference force."""
