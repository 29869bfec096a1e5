"""Everything that can go wrong and is told to a user.

    PneuforceError
    ├── ConfigurationError (ValueError)    a file, a key or an argument
    ├── RigError
    │   ├── PortBusy (OSError)             another process holds the port
    │   ├── PortUnavailable (OSError)      no such port, or no permission
    │   ├── RigSilent (TimeoutError)       nothing, or nothing of ours, came over the cable
    │   ├── ProtocolMismatch (ValueError)  a board that speaks another version
    │   └── TimeOutMismatch (ValueError)   a board that reacts to a silent host after another time
    └── FaceError (OSError)                a bus that cannot be served

Bad measurements and bad requests are never exceptions: they are codes and bits.
"""

from __future__ import annotations


class PneuforceError(Exception):
    """A fact that stops a command, in a sentence that a user can act on."""


class ConfigurationError(PneuforceError, ValueError):
    """A configuration file, key or argument that cannot be accepted."""


class RigError(PneuforceError):
    """The rig at the end of the cable cannot be used."""


class PortBusy(RigError, OSError):
    """Another process holds the serial port."""

    def __init__(self, port: str) -> None:
        super().__init__(f"{port} is in use by another process: end that one first (try: fuser {port})")
        self.port = port


class PortUnavailable(RigError, OSError):
    """The serial port cannot be opened."""

    def __init__(self, port: str, reason: str) -> None:
        super().__init__(f"{port} cannot be opened: {reason}")
        self.port = port


class RigSilent(RigError, TimeoutError):
    """No greeting from a pneuforce board arrived before the deadline."""

    def __init__(self, port: str, waited_s: float, heard_bytes: int) -> None:
        heard = (
            f"{heard_bytes} bytes came, none of them a pneuforce board's: is another device on that port?"
            if heard_bytes
            else "nothing came at all: is the board powered, flashed and connected?"
        )
        super().__init__(f"no greeting from a board on {port} for {waited_s:.1f} s; {heard}")
        self.waited_s = waited_s


class ProtocolMismatch(RigError, ValueError):
    """The board speaks another version of the rig link."""

    def __init__(self, board_version: int, host_version: int) -> None:
        super().__init__(
            f"the board speaks version {board_version} of the rig link, this host version {host_version}: "
            "flash the firmware that came with this release; no valve was moved"
        )
        self.board_version = board_version


class TimeOutMismatch(RigError, ValueError):
    """The board reacts to a silent host after another time than the host counts on."""

    def __init__(self, what: str, board_ms: int, host_ms: int) -> None:
        super().__init__(
            f"the board {what} when its host is silent for {board_ms} ms, this host counts on {host_ms} ms: "
            "flash the firmware that came with this release; nothing was inflated"
        )
        self.board_ms = board_ms
        self.host_ms = host_ms


class FaceError(PneuforceError, OSError):
    """A bus cannot be served."""
