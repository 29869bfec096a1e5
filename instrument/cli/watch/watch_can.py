"""`pneuforce watch can`: show every frame of the instrument as a robot controller receives it."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from contextlib import closing
from threading import Event
from typing import Any

from rich.live import Live

from pneuforce.errors import ServerError
from pneuforce.instrument.cli.terminal.output import CONNECTION_HINT, json_line, print_line, stop_after
from pneuforce.instrument.cli.watch.can_traffic import CanTraffic, format_signals
from pneuforce.registers.can.bus import CanBus
from pneuforce.registers.can.frames import decode_frame
from pneuforce.support.write_error import is_disk_error
from pneuforce.teststand.observer import CanNodeAddress

REDRAW_PERIOD_S = 0.2
#: Time without frames after which a warning is printed. The heartbeat is sent each second.
SILENCE_WARNING_S = 1.5
NODE_HINT = "check that the instrument runs with CAN on this bus, and check --node-id"


def watch_can(node: CanNodeAddress, seconds: float | None, json_lines: bool) -> None:
    """Show every frame of the instrument, decoded.

    Raises ServerError if the bus is not available, or if no frame of the instrument has arrived at the end.
    """
    stop, traffic = stop_after(seconds), CanTraffic()
    try:
        with closing(CanBus(node.bus)) as bus:
            if sys.stdout.isatty() and not json_lines:
                _show_table(bus, node.node_id, stop, traffic)
            else:
                form = json_line if json_lines else _format_frame
                _print_frames(bus, node.node_id, stop, traffic, form)
    except BrokenPipeError:
        raise
    except OSError as error:
        if is_disk_error(error):  # of the output
            raise
        raise ServerError(f"{error}; {CONNECTION_HINT}") from None
    if not traffic.kinds:
        raise ServerError(f"no frame from node {node.node_id} has arrived: {NODE_HINT}")


def _show_table(bus: CanBus, node_id: int, stop: Event, traffic: CanTraffic) -> None:
    """Show a live table. The ages increase even if no frames arrive."""
    drawn_s = 0.0
    with Live(auto_refresh=False) as live:
        while not stop.is_set():
            received, now_s = _receive(bus, node_id), time.monotonic()
            if received:
                traffic.add(received["frame"], received["values"], now_s)
            if now_s >= drawn_s + REDRAW_PERIOD_S:
                drawn_s = now_s
                live.update(traffic.table(now_s), refresh=True)


def _print_frames(
    bus: CanBus, node_id: int, stop: Event, traffic: CanTraffic, format_frame: Callable[[dict[str, Any]], str]
) -> None:
    """Print one line per frame, and one warning on stderr for each time without frames."""
    received_s, warned = time.monotonic(), False
    while not stop.is_set():
        received, now_s = _receive(bus, node_id), time.monotonic()
        if received:
            received_s, warned = now_s, False
            lost = traffic.add(received["frame"], received["values"], now_s)
            print_line(format_frame(received | {"lost": lost}))
        elif now_s > received_s + SILENCE_WARNING_S and not warned:
            warned = True
            silence = f"no frame from node {node_id} for {SILENCE_WARNING_S} s: {NODE_HINT}"
            print(f"pneuforce: {silence}", file=sys.stderr)


def _receive(bus: CanBus, node_id: int) -> dict[str, Any] | None:
    """Return the next frame; None if another node sent it, or if no frame arrives for 0.1 s."""
    received = bus.receive()
    decoded = received and decode_frame(received[1], node_id)
    if not received or not decoded:
        return None
    definition, values = decoded
    return {"t_s": received[0], "frame": definition.name, "values": values}


def _format_frame(received: dict[str, Any]) -> str:
    name, values = received["frame"], received["values"]
    signals = "  ".join(f"{signal} {text}" for signal, text in format_signals(name, values))
    lost = f"  ({received['lost']} lost before)" if received["lost"] else ""
    return f"{received['t_s']:.4f}  {name:<9}  {signals}{lost}"
