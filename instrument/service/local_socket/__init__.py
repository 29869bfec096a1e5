"""Local Unix socket: the server for other processes of this computer, and the recorder that reads from it."""
