"""Commands that show the traffic on Modbus and CAN: watch, canlog, hub."""
