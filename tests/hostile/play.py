"""One case played to a server, and the verdict."""

from __future__ import annotations

import itertools
import time
from collections.abc import Iterator
from dataclasses import dataclass

from tests.hostile.case import CLOSE, Ask, Case, End, HalfClose, NotOffered, Pause, Raw, Step, Together, Wrong
from tests.hostile.line import Closed, Line, Server, Silent, answering, spaced

PASS, FAIL, NOT_OFFERED = "pass", "FAIL", "n/a"


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a server made of a case."""

    case: Case
    verdict: str
    got: str

    def as_json(self) -> dict[str, object]:
        """The outcome as JSON holds it."""
        case = self.case
        return {
            "group": case.group,
            "case": case.name,
            "generic": not case.ours,
            "expected": case.expected,
            "got": self.got,
            "verdict": self.verdict,
        }


def played(case: Case, server: Server) -> Outcome:
    """Play a case, then see whether the server still answers others."""
    try:
        got = case.play(server) if case.play else _scripted(case, server)
        answering(server)
    except NotOffered as told:
        return Outcome(case, NOT_OFFERED, str(told))
    except Wrong as wrong:
        return Outcome(case, FAIL, str(wrong))
    return Outcome(case, PASS, got)


def _scripted(case: Case, server: Server) -> str:
    with Line(server) as line:
        got = [_carried_out(step, line, server) for step in case.steps]
        if not line.closed:
            got.append(_ended(case.end, line, server))
    return ", ".join(filter(None, got))


def _carried_out(step: Step, line: Line, server: Server) -> str:
    match step:
        case Ask():
            return _answered(step, line.ask(step), line, server)
        case Together():
            return _together(step, line, server)
        case Raw():
            line.send(step.data)
        case Pause():
            time.sleep(step.pause_s)
        case HalfClose():
            line.half_close()
    return ""


def _answered(ask: Ask, number: int, line: Line, server: Server) -> str:
    try:
        got, unit, pdu = line.answer(server.patience_s)
    except Closed:
        if CLOSE in ask.legal:
            return "closed"
        raise
    if got != number:
        raise Wrong(f"transaction {got:04x}h instead of {number:04x}h")
    if unit != (server.unit if ask.unit is None else ask.unit):
        raise Wrong(f"unit {unit}")
    if not ask.allows(pdu):
        if ask.not_offered(pdu) and not server.ours:
            raise NotOffered(spaced(pdu))
        raise Wrong(spaced(pdu))
    return spaced(pdu)


def _together(together: Together, line: Line, server: Server) -> str:
    frames = [line.frame_of(ask) for ask in together.asks]
    for piece in _cut(b"".join(data for _, data in frames), together.pieces):
        line.send(piece)
        time.sleep(together.apart_s)
    if together.then_fin:
        line.half_close()
    for at, ((number, _), ask) in enumerate(zip(frames, together.asks, strict=True)):
        try:
            got = _answered(ask, number, line, server)
        except Wrong as wrong:
            raise type(wrong)(f"answer {at + 1} of {len(frames)}: {wrong}") from None
    return got if len(frames) == 1 else f"{len(frames)} answers in order"


def _cut(stream: bytes, pieces: tuple[int, ...]) -> Iterator[bytes]:
    for size in itertools.cycle(pieces):
        yield stream[:size]
        stream = stream[size:]
        if not stream:
            return


def _ended(end: End, line: Line, server: Server) -> str:
    """See that the connection ends as it must. Raises Wrong."""
    if end is End.ANSWERS:
        answering(server, line)
        return ""
    if end is End.OVERDUE:
        return line.wait_closed(server.frame_s + max(server.patience_s, server.frame_s))
    if end is End.CLOSED and not server.ours:
        return _closed_or_recovered(line, server)
    return line.wait_closed(server.patience_s)


def _closed_or_recovered(line: Line, server: Server) -> str:
    """Modbus does not say that a bad header ends a connection; that nothing answers any more is the fault."""
    try:
        return line.wait_closed(server.patience_s)
    except Silent:
        told = "ignored"
    except Wrong as wrong:
        told = str(wrong)
    try:
        answering(server, line)
    except Closed:
        return f"{told}, closed at the next request"
    except Silent:
        raise Wrong(f"{told}, then dead but open") from None
    return f"{told}, goes on"
