"""CAN: frame definitions made from the register map, a node without I/O, bus access, and a small CAN hub."""
