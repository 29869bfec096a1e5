"""Servers of the buses in the host process: Modbus TCP and RTU, CAN, RDT."""
