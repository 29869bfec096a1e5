"""The CANopen face: an object dictionary made from the register map, and the slave without I/O.

Sections and tables of CiA 301 that these files cite are those of version 4.2.0.
"""
