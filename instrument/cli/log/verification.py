"""`pneuforce log verify`: verify the digests of an event log, and compare the log with its witnesses."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.audit.anchor import (
    Anchor,
    NotedDigest,
    check_anchors,
    check_noted,
    collect_heads,
    find_anchors,
)
from pneuforce.instrument.audit.reading import (
    DamagedLogError,
    NotAnEventLogError,
    open_event_log,
    repeated_if_changed,
)
from pneuforce.instrument.audit.verification import (
    BrokenChainError,
    StoredRecord,
    VerifiedChain,
    verify_chain,
)
from pneuforce.instrument.cli.log.witness import Witness, read_witness
from pneuforce.instrument.cli.terminal.failure import failure_values
from pneuforce.instrument.cli.terminal.output import json_text, print_done, print_text
from pneuforce.support.counted import counted
from pneuforce.support.permissions import unreadable

HEAD_PATTERN = re.compile(r"[0-9a-f]{64}")
_NOTED_PATTERN = re.compile(r"([1-9][0-9]{0,9}):([0-9a-f]{8,64})")


class Verification(NamedTuple):
    """Knowledge about a log that is independent of its file."""

    head: str | None = None  #: noted head
    anchors: Path | None = None  #: journal with anchors
    earlier: tuple[Path, ...] = ()  #: logs that were moved away, the oldest first
    noted: tuple[str, ...] = ()  #: heads that were read from the registers, as NUMBER:DIGITS
    witness: str | None = None  #: address of Prometheus
    instance: str | None = None  #: instrument in Prometheus


def verify_events(path: Path, known: Verification, as_json: bool) -> int:
    """Verify a log and print the result. Return the exit code, 1 for a log that was changed.

    Raises ConfigurationError if an option is invalid, the journal contains no anchors, or Prometheus has
    stored no heads. Raises ConnectionFailed if Prometheus does not answer.
    """
    head = known.head.lower() if known.head else None
    if head is not None and not HEAD_PATTERN.fullmatch(head):
        raise ConfigurationError(
            f"--head {known.head} is invalid: a head has 64 hexadecimal digits, as verify prints"
        )
    _check_options(known)
    noted = [_parse_noted(text) for text in known.noted]
    # Both are read before the log, so that the log of a running instrument contains each head.
    anchors = _read_anchors(known.anchors) if known.anchors else []
    witness = read_witness(known.witness, known.instance) if known.witness else None
    wanted = [*anchors, *noted, *(witness.noted if witness else ())]
    try:
        heads: list[dict[int, str]] = []
        for earlier in known.earlier:
            heads.append({})
            repeated_if_changed(earlier, partial(_verify_file, earlier, None, wanted, heads[-1]))
        heads.append({})
        chain = repeated_if_changed(path, partial(_verify_file, path, head, wanted, heads[-1]))
        check_anchors(anchors, heads)
        check_noted(noted, heads)
        if witness:
            witness.check(heads, chain.records)
    except (BrokenChainError, DamagedLogError) as error:
        failed = failure_values(error) | _witness_values(witness)
        print_text(json_text(failed) if as_json else f"{path}: NOT GOOD: {error}{_witness_lines(witness)}")
        return 1
    text = _format(chain, anchors, len(noted) + (head is not None))
    counts = {"anchors": len(anchors), "noted": len(noted)}
    values = {"file": str(path), **chain._asdict(), **counts, **_witness_values(witness)}
    print_done(text if as_json else f"{text}{_witness_lines(witness)}", as_json, **values)
    return 0


def _check_options(known: Verification) -> None:
    """Raise ConfigurationError if an option lacks the option to which it belongs."""
    if known.earlier and known.anchors is None and not known.noted and known.witness is None:
        raise ConfigurationError(
            "--earlier is valid only with --anchors, --noted or --witness: it names logs for them"
        )
    if known.instance is not None and known.witness is None:
        raise ConfigurationError("--instance is valid only with --witness: it selects an instrument there")


def _witness_values(witness: Witness | None) -> dict[str, Any]:
    return {"witness": witness.report._asdict()} if witness and witness.report else {}


def _witness_lines(witness: Witness | None) -> str:
    """Return one line for each fact of the comparison, each after a line break."""
    if witness is None or witness.report is None:
        return ""
    agrees, missing, contradicts = witness.report
    lines = [f"agrees: {agrees}", *(f"missing: {text}" for text in missing)]
    lines += [f"contradicts: {text}" for text in contradicts]
    return "".join(f"\nwitness {witness.url} {line}" for line in lines)


def _parse_noted(text: str) -> NotedDigest:
    """Return a noted head. Raises ConfigurationError."""
    match = _NOTED_PATTERN.fullmatch(text.lower())
    if match is None:
        raise ConfigurationError(
            f"--noted {text} is invalid: write the number of records, a colon and at least the first 8 "
            "hexadecimal digits of the digest, for example 1234:49a95ea7"
        )
    return NotedDigest(int(match[1]), match[2])


def _verify_file(
    path: Path, head: str | None, anchors: list[Anchor | NotedDigest], heads: dict[int, str]
) -> VerifiedChain:
    """Verify one log and store in `heads` the digests at the numbers of the anchors."""
    intact = 0

    def count_verified(rows: Iterable[StoredRecord]) -> Iterator[StoredRecord]:
        """Yield the rows. A row is counted when the next one is requested, because it is verified then."""
        nonlocal intact
        for row in rows:
            yield row
            intact += 1

    try:
        with open_event_log(path) as rows:
            chain = verify_chain(count_verified(collect_heads(rows, anchors, heads)), head)
    except NotAnEventLogError:
        raise
    except DamagedLogError as error:
        raise DamagedLogError(
            f"{error}; intact before the damage: {counted(intact, 'record')}. How to save the other records: "
            "docs/events.md, section A damaged log"
        ) from None
    if not chain.records:
        raise BrokenChainError(
            f"{path} contains no record: was the log moved or copied without the file that ends in -wal?"
        )
    return chain


def _read_anchors(path: Path) -> list[Anchor]:
    """Return the anchors in a file, or in stdin if the path is `-`. Raises ConfigurationError."""
    try:
        with (Path("/dev/stdin") if path == Path("-") else path).open("rb") as journal:
            anchors = find_anchors(journal)
    except PermissionError:
        raise ConfigurationError(f"{path}: {unreadable(path)}") from None
    except OSError as error:
        raise ConfigurationError(f"{path}: the journal cannot be read: {error.strerror or error}") from None
    if not anchors:
        raise ConfigurationError(
            f"{path}: the journal contains no anchor of an event log: name the output of "
            "journalctl -u pneuforce, or -u pneuforce@NAME if the computer has several instruments"
        )
    return anchors


def _format(chain: VerifiedChain, anchors: list[Anchor], noted_heads: int) -> str:
    included = [
        *(["the noted head" if noted_heads == 1 else f"{noted_heads} noted heads"] if noted_heads else []),
        *([f"{counted(len(anchors), 'anchor')} from {anchors[0].at} to {anchors[-1].at}"] if anchors else []),
    ]
    return format_chain(chain, included)


def format_chain(chain: VerifiedChain, included: Iterable[str] = ()) -> str:
    """Return one sentence about an unbroken chain, with the noted heads that the chain contains."""
    extent = f"{counted(chain.records, 'record')} from {chain.first_at} to {chain.last_at}, unbroken"
    return f"{extent}{''.join(f', including {text}' for text in included)}, head {chain.head}"
