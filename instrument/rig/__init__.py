"""The rig link: bytes to frames and back, the handshake, and the serial port."""
