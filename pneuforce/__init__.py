"""Pneumatic force sensor as a field instrument: force over Modbus and CAN, with its uncertainty."""
