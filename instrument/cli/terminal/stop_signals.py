"""Signals that end a command which runs until it is stopped."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable

#: Ctrl-C, `kill`, and the end of the terminal.
STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def at_stop_signal(*calls: Callable[[], None]) -> None:
    """Make the calls in another thread at the first stop signal. A signal that is ignored stays ignored.

    The handler itself does nothing, because it can interrupt code of this thread that holds a lock.
    """
    received, sent = os.pipe()
    os.set_blocking(sent, False)
    signal.set_wakeup_fd(sent)
    for number in STOP_SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, lambda *_: None)

    def wait() -> None:
        os.read(received, 1)
        for call in calls:
            call()

    threading.Thread(target=wait, name="stop-signal", daemon=True).start()
