"""Recording of all inputs of an instrument, with their times and the measurements that resulted."""
