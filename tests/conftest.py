"""What holds for all tests."""

import signal

# What a script starts in its background ignores Ctrl-C, and so would every program that a test starts.
signal.signal(signal.SIGINT, signal.default_int_handler)
