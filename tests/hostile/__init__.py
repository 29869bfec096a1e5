"""Hostile cases for any Modbus TCP server: `python -m tests.hostile --port 5020`. Only Python is needed."""
