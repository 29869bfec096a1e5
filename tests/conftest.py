"""Settings for all tests."""

import signal

# A background job of a shell ignores Ctrl-C, and every program that a test starts would inherit this.
signal.signal(signal.SIGINT, signal.default_int_handler)
