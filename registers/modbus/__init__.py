"""Modbus server: register bank, request handler and framing without I/O, with TCP and RTU transports."""
