"""`pneuforce replay FILE`: verify a recording, and print the result."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

from pneuforce.instrument.cli.terminal.failure import checked_values
from pneuforce.instrument.cli.terminal.output import json_line, print_text, progress
from pneuforce.instrument.service.replay_verification import ReplayResult, open_replayable, verify_recording
from pneuforce.support.counted import counted


def replay(file: Path, as_json: bool) -> int:
    """Verify a recording. Return the exit code: 0 if the file is undamaged and all samples are equal, else 1.

    Raises PneuforceError.
    """
    # Do not print the log messages: the instrument has already logged them during the recording.
    logging.getLogger("pneuforce").addHandler(logging.NullHandler())
    with open_replayable(file) as recording, progress("replayed") as report:
        result = verify_recording(recording, report)
    passed, text = result.equal and not result.damaged, _format_result(result)
    print_text(json_line(checked_values(passed, text) | _facts(result)) if as_json else text)
    return 0 if passed else 1


def _facts(result: ReplayResult) -> dict[str, Any]:
    difference = result.difference
    return {
        "file": str(result.file),
        "samples": result.samples,
        "duration_s": result.duration_s,
        "took_s": result.took_s,
        "times_real_time": result.times_real_time,
        "equal": result.equal,
        "difference": difference and difference._asdict(),
        "remark": result.remark,
    }


def _format_result(result: ReplayResult) -> str:
    speed = f"replayed in {result.took_s:.1f} s, {result.times_real_time:.0f} times real time"
    lines = [f"{counted(result.samples, 'sample')} of {result.duration_s:.1f} s, {speed}"]
    if result.difference is not None:
        lines.append(f"differs: {result.difference}")
    elif result.unexplained:
        lines.append(f"differs: the replay does not produce the last {counted(result.unexplained, 'sample')}")
    elif not result.samples:
        lines.append("no sample was compared")
    else:
        lines.append(f"all {'undamaged samples ' if result.damaged else ''}equal, to the last bit")
    return "\n".join([*lines, result.remark] if result.remark else lines)
