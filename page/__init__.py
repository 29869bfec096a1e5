"""The instrument's page: a process of its own between the local socket and the browsers."""
