"""Processes beside the host: web page, MQTT, Modbus/TCP Security, recorder."""
