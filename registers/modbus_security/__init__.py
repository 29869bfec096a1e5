"""Modbus/TCP Security (Modbus Organization, MB-TCP-Security v36): Modbus in TLS, with roles."""
