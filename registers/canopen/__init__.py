"""CANopen: an object dictionary made from the register map, and the NMT slave without I/O.

Sections and tables of CiA 301 are cited from version 4.2.0.
"""
