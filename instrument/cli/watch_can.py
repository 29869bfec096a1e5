"""`pneuforce watch can`: every frame of the instrument as a robot controller sees it."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from contextlib import closing
from threading import Event
from typing import Any

from rich.live import Live

from instrument.cli.can_traffic import Traffic, signals
from instrument.cli.observe import NodeAt
from instrument.cli.showing import HINT, as_json, say, stop_after
from instrument.errors import FaceError
from registers.can.bus import Bus
from registers.can.frames import read

REDRAW_S = 0.2
SILENT_S = 1.5  #: the heartbeat alone comes each second


def watch_can(node: NodeAt, seconds: float | None, json_lines: bool) -> None:
    """Show every frame of the instrument, decoded. Raises FaceError where there is no bus."""
    stop = stop_after(seconds)
    try:
        with closing(Bus(node.at)) as bus:
            if sys.stdout.isatty() and not json_lines:
                _draw(bus, node.node_id, stop)
            else:
                _list(bus, node.node_id, stop, as_json if json_lines else _line)
    except BrokenPipeError:
        raise
    except OSError as error:
        raise FaceError(f"{error}; {HINT}") from None


def _draw(bus: Bus, node_id: int, stop: Event) -> None:
    """A table that goes on ageing when nothing comes."""
    traffic, drawn_s = Traffic(), 0.0
    with Live(auto_refresh=False) as live:
        while not stop.is_set():
            heard, now_s = _next(bus, node_id), time.monotonic()
            if heard:
                traffic.note(heard["frame"], heard["values"], now_s)
            if now_s >= drawn_s + REDRAW_S:
                drawn_s = now_s
                live.update(traffic.table(now_s), refresh=True)


def _list(bus: Bus, node_id: int, stop: Event, line: Callable[[dict[str, Any]], str]) -> None:
    """A line for each frame; silence is told as well."""
    traffic, heard_s = Traffic(), time.monotonic()
    while not stop.is_set():
        heard, now_s = _next(bus, node_id), time.monotonic()
        if heard:
            heard_s = now_s
            say(line(heard | {"lost": traffic.note(heard["frame"], heard["values"], now_s)}))
        elif now_s > heard_s + SILENT_S:
            heard_s = now_s
            print(f"pneuforce: nothing from node {node_id} for {SILENT_S} s", file=sys.stderr)


def _next(bus: Bus, node_id: int) -> dict[str, Any] | None:
    """The next frame where it is the instrument's; None after 0.1 s of silence, too."""
    received = bus.receive()
    ours = received and read(received[1], node_id)
    if not received or not ours:
        return None
    declared, values = ours
    return {"t_s": received[0], "frame": declared.name, "values": values}


def _line(seen: dict[str, Any]) -> str:
    told = "  ".join(f"{name} {text}" for name, text in signals(seen["frame"], seen["values"]))
    lost = f"  ({seen['lost']} lost before)" if seen["lost"] else ""
    return f"{seen['t_s']:.4f}  {seen['frame']:<9}  {told}{lost}"
