"""CAN frame log in the file formats of other tools, written by python-can."""

from __future__ import annotations

from collections.abc import Mapping
from typing import IO, Any

from pneuforce.registers.can.wire import CanFrame, FrameKind

#: Format → name of python-can's writer, and True if the writer writes text.
LOG_FORMATS: Mapping[str, tuple[str, bool]] = {
    "candump": ("CanutilsLogWriter", True),
    "asc": ("ASCWriter", True),
    "blf": ("BLFWriter", False),
}


class CanLogWriter:
    """Writer of CAN frames to `file`. `close` also closes the file.

    A text file must be line-buffered. Each line of a candump or ASC file is then in the file before the next
    frame is written. A BLF file is written in blocks of 128 KB, and is complete only after `close`.
    """

    def __init__(self, file: IO[Any], log_format: str, channel: str) -> None:
        import can

        self.frame_count = 0
        self._can = can
        self._channel = channel
        self._writer = getattr(can, LOG_FORMATS[log_format][0])(file, channel=channel)

    def write(self, t_s: float, frame: CanFrame) -> None:
        """Write one frame that was received at `t_s` [s since 1970]. Raises OSError."""
        message = self._can.Message(
            timestamp=t_s,
            arbitration_id=frame.id,
            data=frame.data,
            is_extended_id=FrameKind.EXTENDED in frame.kind,
            is_remote_frame=FrameKind.REMOTE in frame.kind,
            is_error_frame=FrameKind.ERROR in frame.kind,
            channel=self._channel,
        )
        self._writer.on_message_received(message)
        self.frame_count += 1

    def close(self) -> None:
        """Write the end of the log and close the file. Raises OSError."""
        self._writer.stop()
