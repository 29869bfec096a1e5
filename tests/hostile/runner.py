"""Runner that runs one case against a server and determines the verdict."""

from __future__ import annotations

import itertools
import time
from collections.abc import Iterator
from dataclasses import dataclass

from tests.hostile.case import (
    CLOSE,
    CaseFailure,
    ExpectedEnd,
    HalfClose,
    HostileCase,
    ModbusRequest,
    NotSupported,
    Pause,
    Pipelined,
    RawBytes,
    Step,
)
from tests.hostile.connection import (
    ConnectionClosed,
    NoAnswer,
    RawConnection,
    ServerUnderTest,
    check_answers,
    spaced,
)

PASS, FAIL, NOT_SUPPORTED = "pass", "FAIL", "n/a"


@dataclass(frozen=True, slots=True)
class CaseResult:
    """Result of one case for one server."""

    case: HostileCase
    verdict: str
    got: str

    def as_json(self) -> dict[str, object]:
        """Return the result as a JSON object."""
        case = self.case
        return {
            "group": case.group,
            "case": case.name,
            "generic": not case.needs_pneuforce,
            "expected": case.expected,
            "got": self.got,
            "verdict": self.verdict,
        }


def run_case(case: HostileCase, server: ServerUnderTest) -> CaseResult:
    """Run a case, then check that the server still answers on a new connection."""
    try:
        got = case.run(server) if case.run else _run_steps(case, server)
        check_answers(server)
    except NotSupported as reason:
        return CaseResult(case, NOT_SUPPORTED, str(reason))
    except CaseFailure as failure:
        return CaseResult(case, FAIL, str(failure))
    return CaseResult(case, PASS, got)


def _run_steps(case: HostileCase, server: ServerUnderTest) -> str:
    with RawConnection(server) as connection:
        got = [_run_step(step, connection, server) for step in case.steps]
        if not connection.closed:
            got.append(_check_end(case.end, connection, server))
    return ", ".join(filter(None, got))


def _run_step(step: Step, connection: RawConnection, server: ServerUnderTest) -> str:
    match step:
        case ModbusRequest():
            return _check_answer(step, connection.send_request(step), connection, server)
        case Pipelined():
            return _send_pipelined(step, connection, server)
        case RawBytes():
            connection.send(step.data)
        case Pause():
            time.sleep(step.pause_s)
        case HalfClose():
            connection.half_close()
    return ""


def _check_answer(
    request: ModbusRequest, expected: int, connection: RawConnection, server: ServerUnderTest
) -> str:
    """Return the answer to a request with the transaction identifier `expected`. Raises CaseFailure."""
    try:
        transaction, unit, pdu = connection.read_answer(server.answer_timeout_s)
    except ConnectionClosed:
        if CLOSE in request.legal:
            return "closed"
        raise
    if transaction != expected:
        raise CaseFailure(f"transaction {transaction:04x}h instead of {expected:04x}h")
    if unit != (server.unit if request.unit is None else request.unit):
        raise CaseFailure(f"unit {unit}")
    if not request.allows(pdu):
        if request.is_not_supported(pdu) and not server.is_pneuforce_server:
            raise NotSupported(spaced(pdu))
        raise CaseFailure(spaced(pdu))
    return spaced(pdu)


def _send_pipelined(pipelined: Pipelined, connection: RawConnection, server: ServerUnderTest) -> str:
    frames = [connection.frame_of(request) for request in pipelined.requests]
    for segment in _segments(b"".join(data for _, data in frames), pipelined.segment_sizes):
        connection.send(segment)
        time.sleep(pipelined.delay_s)
    if pipelined.then_fin:
        connection.half_close()
    for number, ((transaction, _), request) in enumerate(zip(frames, pipelined.requests, strict=True), 1):
        try:
            got = _check_answer(request, transaction, connection, server)
        except CaseFailure as failure:
            raise type(failure)(f"answer {number} of {len(frames)}: {failure}") from None
    return got if len(frames) == 1 else f"{len(frames)} answers in order"


def _segments(stream: bytes, sizes: tuple[int, ...]) -> Iterator[bytes]:
    for size in itertools.cycle(sizes):
        yield stream[:size]
        stream = stream[size:]
        if not stream:
            return


def _check_end(end: ExpectedEnd, connection: RawConnection, server: ServerUnderTest) -> str:
    """Check the state of the connection after the last step. Raises CaseFailure."""
    if end is ExpectedEnd.OPEN:
        check_answers(server, connection)
        return ""
    if end is ExpectedEnd.TIMED_OUT:
        margin_s = max(server.answer_timeout_s, server.frame_timeout_s)
        return connection.wait_closed(server.frame_timeout_s + margin_s)
    if end is ExpectedEnd.CLOSED and not server.is_pneuforce_server:
        return _closed_or_recovered(connection, server)
    return connection.wait_closed(server.answer_timeout_s)


def _closed_or_recovered(connection: RawConnection, server: ServerUnderTest) -> str:
    """Return a description if the connection is closed or still usable after an invalid header.

    Modbus does not require that an invalid header closes the connection. Raises CaseFailure if the connection
    stays open but requests are no longer answered.
    """
    try:
        return connection.wait_closed(server.answer_timeout_s)
    except NoAnswer:
        reaction = "ignored"
    except CaseFailure as failure:
        reaction = str(failure)
    try:
        check_answers(server, connection)
    except ConnectionClosed:
        return f"{reaction}, closed at the next request"
    except NoAnswer:
        raise CaseFailure(f"{reaction}, then dead but open") from None
    return f"{reaction}, goes on"
