"""Other Modbus servers for the hostile cases: their start, and the page that compares them."""
