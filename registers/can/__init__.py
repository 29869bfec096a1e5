"""The CAN face: frames declared from the register map, the node without I/O, the bus and a small hub."""
