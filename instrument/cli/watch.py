"""`pneuforce watch`: a client that shows what a PLC or a robot controller would see."""

from __future__ import annotations

import json
import math
import signal
import sys
import time
from collections.abc import Iterator
from threading import Event, Timer
from typing import Any

from instrument.cli.observe import NodeAt, can_frames
from instrument.errors import FaceError
from registers.map import REGISTERS
from registers.modbus.client import Plc, PlcError

POLL_S = 0.5
UNITS = {register.name: register.unit for register in REGISTERS}


def watch_modbus(host: str, port: int, seconds: float | None, as_json: bool) -> None:
    """Poll the registers twice a second; what changed stands out by being printed again."""
    stop = _stop_after(seconds)
    try:
        with Plc.connect(host, port) as plc:
            _poll(plc, stop, as_json)
    except PlcError as error:
        raise FaceError(f"{error}; is an instrument running there? (pneuforce demo starts one)") from None


def _poll(plc: Plc, stop: Event, as_json: bool) -> None:
    shown: dict[str, Any] = {}
    while True:
        values = plc.read()
        if as_json:
            _print(json.dumps({"t_s": time.time()} | {k: plain(v) for k, v in values.items()}))
        else:
            _print(_changes(values, shown))
        shown = values
        if stop.wait(POLL_S):
            return


def _changes(values: dict[str, Any], shown: dict[str, Any]) -> str:
    changed = (
        f"{name} {text(value)}{' ' + UNITS[name] if UNITS.get(name) else ''}"
        for name, value in values.items()
        if text(value) != text(shown.get(name))
    )
    return f"{time.strftime('%H:%M:%S')}  " + "  ".join(changed)


def watch_can(node: NodeAt, seconds: float | None, as_json: bool) -> None:
    """Print every frame of the instrument, decoded."""
    stop = _stop_after(seconds)
    try:
        for t_s, name, values in _until(stop, can_frames(node, stop)):
            if as_json:
                plain_values = {k: plain(v) for k, v in values.items()}
                _print(json.dumps({"t_s": t_s, "frame": name, "values": plain_values}))
            else:
                _print(f"{t_s:.4f}  {name:<9}  " + "  ".join(f"{k} {text(v)}" for k, v in values.items()))
    except OSError as error:
        raise FaceError(f"{error}; is an instrument running there? (pneuforce demo starts one)") from None


def _until(stop: Event, frames: Iterator[tuple[float, str, dict[str, Any]]]) -> Iterator[Any]:
    for frame in frames:
        if stop.is_set():
            return
        yield frame


def _stop_after(seconds: float | None) -> Event:
    stop = Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    if seconds is not None:
        timer = Timer(seconds, stop.set)
        timer.daemon = True
        timer.start()
    return stop


def plain(value: Any) -> Any:
    """A value that JSON knows; None where it is not available."""
    if isinstance(value, frozenset):
        return sorted(value)
    return None if isinstance(value, float) and not math.isfinite(value) else value


def text(value: Any) -> str:
    """A value for a person."""
    if isinstance(value, frozenset):
        return ",".join(sorted(value)) or "none"
    if isinstance(value, float):
        return f"{value:.3f}" if math.isfinite(value) else "–"
    return str(value)


def _print(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()
