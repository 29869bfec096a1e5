"""Validation as the paper did it: the contacts of a recording, their force beside a reference."""
