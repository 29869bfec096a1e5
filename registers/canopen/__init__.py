"""The CANopen face (CiA 301): an object dictionary made from the register map, and the slave without I/O."""
