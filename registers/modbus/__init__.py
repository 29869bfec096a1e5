"""The Modbus face: address space, request core and framing without I/O, and a thin TCP transport."""
