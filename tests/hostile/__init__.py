"""Hostile cases for any Modbus TCP server: `python -m tests.hostile --port 5020`; needs Python alone."""
