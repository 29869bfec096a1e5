"""Users of the web page: their file, and the salted hashes of their passwords."""
