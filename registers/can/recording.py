"""CAN frames kept in a file as they come, in the formats that other tools read, by python-can's writers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import IO, Any

from registers.can.wire import CanFrame, Kind

#: Format → python-can's writer, and whether it writes text.
WRITERS: Mapping[str, tuple[str, bool]] = {
    "candump": ("CanutilsLogWriter", True),
    "asc": ("ASCWriter", True),
    "blf": ("BLFWriter", False),
}


class Recording:
    """Frames on their way into `file`, which is closed with it; text must be opened line by line.

    In candump and ASC each line is in the file before the next frame is looked at. BLF collects 128 KB and is
    whole only once it is closed.
    """

    def __init__(self, file: IO[Any], form: str, channel: str) -> None:
        import can

        self.frames = 0
        self._can = can
        self._channel = channel
        self._writer = getattr(can, WRITERS[form][0])(file, channel=channel)

    def note(self, t_s: float, frame: CanFrame) -> None:
        """Write one frame that came at `t_s` [s since 1970]. Raises OSError."""
        message = self._can.Message(
            timestamp=t_s,
            arbitration_id=frame.id,
            data=frame.data,
            is_extended_id=Kind.EXTENDED in frame.kind,
            is_remote_frame=Kind.REMOTE in frame.kind,
            is_error_frame=Kind.ERROR in frame.kind,
            channel=self._channel,
        )
        self._writer.on_message_received(message)
        self.frames += 1

    def close(self) -> None:
        """Write what the format wants at its end. Raises OSError."""
        self._writer.stop()
