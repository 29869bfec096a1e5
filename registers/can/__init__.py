"""CAN: frame definitions made from the register map, a node without I/O, the bus, and a small CAN hub."""
