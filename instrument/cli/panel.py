"""The live panel of the demo, and its one line a second where there is no terminal."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from rich.console import Group, RenderableType
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from instrument.cli.observe import Seen, number

BLOCKS = " ▁▂▃▄▅▆▇█"
SPARK_WIDTH = 60


@dataclass(frozen=True, slots=True)
class Ports:
    """Where the demo's buses are."""

    modbus: int = 5020
    can: int = 29536


def shown(value: float, form: str, unit: str) -> str:
    """A number with its unit, or a dash where it is not available."""
    return f"{value:{form}} {unit}" if math.isfinite(value) else f"– {unit}"


def spark(values: Sequence[float], low: float, high: float, width: int = SPARK_WIDTH) -> str:
    """A line of blocks; a gap where a value is not available."""
    picked = values[-width * (len(values) // width or 1) :: len(values) // width or 1][-width:]
    return "".join(_block(value, low, high) for value in picked)


def _block(value: float, low: float, high: float) -> str:
    if not math.isfinite(value):
        return " "
    share = (value - low) / (high - low) if high > low else 0.0
    return BLOCKS[round(min(max(share, 0.0), 1.0) * 7) + 1]


def force_text(seen: Seen) -> str:
    """Force ± its standard uncertainty."""
    force, std = number(seen.modbus, "force"), number(seen.modbus, "force_uncertainty")
    return f"{force:6.3f} ± {std:.3f} N" if math.isfinite(force) else "not available"


def plain_line(seen: Seen, elapsed_s: float, now_s: float) -> str:
    """One second of the demo in one line."""
    m = seen.modbus
    return (
        f"{elapsed_s:5.0f} s  {m.get('state', '…'):<9}  force {force_text(seen):<17}"
        f"  CAN {shown(number(seen.can, 'force'), '.3f', 'N')}"
        f"  applied {shown(number(seen.truth, 'force_n'), '.3f', 'N')}"
        f"  pressure {shown(number(m, 'pressure'), '.3f', 'kPa')}"
        f"  R_i {shown(number(m, 'radius'), '.3f', 'mm')}"
        f"  setpoint {shown(number(m, 'setpoint'), '.3f', 'kPa')}"
        f"  contacts {m.get('contact_counter', 0)}"
        f"  modbus {seen.polls.per_s(now_s)}/s  can {seen.frames.per_s(now_s)}/s"
    )


def panel(seen: Seen, ports: Ports, elapsed_s: float, now_s: float) -> RenderableType:
    """The whole panel."""
    return Group(
        Panel(_measured(seen), title="pneuforce demo · simulated rig", subtitle=f"{elapsed_s:.0f} s"),
        Panel(_traffic(seen, now_s), title="buses"),
        Panel(_second_terminal(ports), title="in a second terminal"),
    )


def _measured(seen: Seen) -> RenderableType:
    m = seen.modbus
    grid = Table.grid(padding=(0, 3))
    left, right = Table.grid(padding=(0, 2)), Table.grid(padding=(0, 2))
    for name, value in (
        ("force", Text(force_text(seen), style="bold cyan")),
        ("applied (truth)", shown(number(seen.truth, "force_n"), "6.3f", "N")),
        ("pressure", shown(number(m, "pressure"), "6.3f", "kPa")),
        ("ΔP_i · rise", _pair(m, "initial_pressure", "rise")),
    ):
        left.add_row(name, value)
    for name, value in (
        ("state", Text(str(m.get("state", "…")), style=_state_style(m))),
        ("setpoint", shown(number(m, "setpoint"), ".3f", "kPa")),
        ("R_i", shown(number(m, "radius"), ".3f", "mm")),
        (
            "contacts",
            f"{m.get('contact_counter', 0)}, last peak {shown(number(m, 'peak_force'), '.2f', 'N')}",
        ),
    ):
        right.add_row(name, value)
    grid.add_row(left, right)
    forces = [force for _, force, _ in seen.history]
    pressures = [pressure for _, _, pressure in seen.history]
    curves = Table.grid(padding=(0, 1))
    curves.add_row("force   ", Text(spark(forces, 0.0, 3.5), style="cyan"), "0–3.5 N")
    curves.add_row("pressure", Text(spark(pressures, 0.0, 14.0), style="green"), "0–14 kPa")
    return Group(grid, Text(), curves)


def _pair(m: dict[str, object], first: str, second: str) -> str:
    return f"{shown(number(m, first), '6.3f', 'kPa')} · {shown(number(m, second), '.3f', 'kPa')}"


def _state_style(m: dict[str, object]) -> str:
    return {"holding": "bold green", "tripped": "bold red"}.get(str(m.get("state")), "bold yellow")


def _traffic(seen: Seen, now_s: float) -> RenderableType:
    grid = Table.grid(padding=(0, 2))
    force, can = number(seen.modbus, "force"), number(seen.can, "force")
    grid.add_row(
        "Modbus",
        f"{seen.polls.per_s(now_s):4d} polls/s",
        f"{seen.polls.count:7d} in all",
        shown(force, ".3f", "N"),
    )
    grid.add_row(
        "CAN",
        f"{seen.frames.per_s(now_s):4d} frames/s",
        f"{seen.frames.count:7d} in all",
        shown(can, ".3f", "N"),
    )
    return grid


def _second_terminal(ports: Ports) -> Text:
    watch = "" if ports.modbus == 5020 else f" --port {ports.modbus}"
    watch_can = "" if ports.can == 29536 else f" --port {ports.can}"
    return Text(
        f"as a PLC      .venv/bin/pneuforce watch modbus{watch}\n"
        f"as a robot    .venv/bin/pneuforce watch can{watch_can}\n"
        f"set 8 kPa     mbpoll -m tcp -p {ports.modbus} -0 -B -1 -t 4:float -r 512 127.0.0.1 8.0\n"
        f"vent          mbpoll -m tcp -p {ports.modbus} -0 -1 -r 516 127.0.0.1 0\n"
        "end           Ctrl-C here"
    )
