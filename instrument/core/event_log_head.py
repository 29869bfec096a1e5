"""Head of the event log, which the buses show."""

from __future__ import annotations

from typing import NamedTuple


class EventLogHead(NamedTuple):
    """Number of records on the disk, and digest of the last record. Without an event log, both are zero."""

    records: int = 0
    digest: bytes = bytes(32)

    def digest_word(self, index: int) -> int:
        """Return 32 bits of the digest as a number. Index 0 gives the first 8 hexadecimal digits."""
        return int.from_bytes(self.digest[4 * index : 4 * index + 4], "big")
