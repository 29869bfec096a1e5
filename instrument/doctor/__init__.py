"""What a rig is examined for, before anybody relies on it: the port, the board's signal, the circuit."""
