"""Other Modbus servers for the same cases: how they are started, and the comparison page."""
