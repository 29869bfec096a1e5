"""Web server of the instrument: a separate process between the local socket and the browsers."""
