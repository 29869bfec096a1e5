"""Connections of the web server: limits, eviction, TLS, and requests in JSON."""
