"""Options of the RDT server."""

from __future__ import annotations

from dataclasses import dataclass

from pneuforce.registers.rdt.record import RDT_PORT


@dataclass(frozen=True, slots=True, kw_only=True)
class RdtOptions:
    """Options of the server."""

    host: str = "127.0.0.1"
    port: int = RDT_PORT
    allow: tuple[str, ...] = ()  #: addresses and networks that may send requests; empty: all
    stream_timeout_s: float = 0.0  #: time after which a stream without a renewed start ends; 0: never
