"""Checks of one or several configurations before the start: files, certificates, ports, boards."""
