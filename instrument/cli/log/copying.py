"""`pneuforce log copy`: copy an event log while an instrument writes the log, and verify the copy."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.audit.copying import copy_event_log
from pneuforce.instrument.audit.reading import DamagedLogError, repeated_if_changed
from pneuforce.instrument.audit.verification import BrokenChainError, VerifiedChain
from pneuforce.instrument.cli.log.verification import format_chain
from pneuforce.instrument.cli.terminal.failure import failure_values
from pneuforce.instrument.cli.terminal.output import json_text, print_done, print_text
from pneuforce.support.atomic_file import check_new, replaced_user_file

_SIDE_FILES = ("-wal", "-shm", "-journal")


def copy_events(source: Path, target: Path, overwrite: bool, as_json: bool) -> int:
    """Copy a log and print the result. Return the exit code, 1 for a log that is damaged or was changed.

    An existing target is replaced only when the copy is complete and verified. Raises ConfigurationError if
    the log or the target cannot be used, WriteFailed if the disk is full.
    """
    _check_target(source, target, overwrite)
    try:
        chain = repeated_if_changed(source, partial(_copied, source, target))
    except (BrokenChainError, DamagedLogError) as error:
        message = (
            f"{source}: NOT GOOD: {error}; no copy was written. To keep this log as evidence, stop the "
            "instrument and copy the file, with the file that ends in -wal if there is one"
        )
        print_text(json_text(failure_values(error, message)) if as_json else message)
        return 1
    values = {"file": str(target), **chain._asdict()}
    print_done(f"{target}: {format_chain(chain)}", as_json, **values)
    return 0


def _copied(source: Path, target: Path) -> VerifiedChain:
    with replaced_user_file(target) as temporary:
        return copy_event_log(source, temporary)


def _check_target(source: Path, target: Path, overwrite: bool) -> None:
    """Raise ConfigurationError if the target has no folder, exists, is the log, or has other side files."""
    if not target.parent.is_dir():
        raise ConfigurationError(f"{target} cannot be written: create the folder {target.parent} before")
    log_files = [source, *(Path(f"{source}{suffix}") for suffix in _SIDE_FILES)]
    if any(file.exists() and target.exists() and target.samefile(file) for file in log_files):
        raise ConfigurationError(f"{target} is a file of the log itself: name another file for the copy")
    check_new(target, overwrite)
    for suffix in _SIDE_FILES:
        if Path(f"{target}{suffix}").exists():
            raise ConfigurationError(
                f"{target}{suffix} belongs to another log, and SQLite would read its records into the copy: "
                "move this file away, or name another file for the copy"
            )
