"""Live panel of the demo, and lines of text for a demo without a terminal."""

from __future__ import annotations

import math
import shutil
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.console import Group, RenderableType
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from pneuforce.teststand.observer import ObservedValues, value_or_nan

Rows = tuple[tuple[str, RenderableType], ...]
BLOCKS = " ▁▂▃▄▅▆▇█"
SPARKLINE_WIDTH = 56
COLUMN_WIDTHS = (15, 22, 8, 25)  #: widths [characters]: columns and gaps fill 80 characters
FORCE_LABEL = "force ± u"
DEMO_USER = "demo"
MAX_EVENTS = 3  #: number of events in the panel


@dataclass(frozen=True, slots=True)
class DemoPorts:
    """TCP ports of the demo's buses and of its web page."""

    modbus: int = 5020
    can: int = 29536
    web: int = 8080
    password: str = ""  #: password of the user `DEMO_USER` of the web page

    @property
    def url(self) -> str:
        """Return the address of the web page that logs the operator of the demo in."""
        return f"http://127.0.0.1:{self.web}/#user={DEMO_USER}&password={self.password}"


def format_number(value: float, form: str, unit: str) -> str:
    """Return a number with its unit, or a dash of the same width if the number is not available."""
    text = f"{value:{form}}" if math.isfinite(value) else "–".rjust(len(f"{0.0:{form}}"))
    return f"{text} {unit}"


def sparkline(values: Sequence[float], low: float, high: float, width: int = SPARKLINE_WIDTH) -> str:
    """Return a line of block characters. The latest value is at the right end, and NaN is a gap."""
    picked = values[-width * (len(values) // width or 1) :: len(values) // width or 1][-width:]
    return "".join(_block(value, low, high) for value in picked).rjust(width)


def _block(value: float, low: float, high: float) -> str:
    if not math.isfinite(value):
        return " "
    share = (value - low) / (high - low) if high > low else 0.0
    return BLOCKS[round(min(max(share, 0.0), 1.0) * 7) + 1]


def format_force(values: ObservedValues) -> str:
    """Return the force with its standard uncertainty u. `FORCE_LABEL` is its label."""
    force, std = value_or_nan(values.modbus, "force"), value_or_nan(values.modbus, "force_uncertainty")
    return f"{force:6.3f} ± {std:.3f} N" if math.isfinite(force) else "not available"


def format_line(values: ObservedValues, elapsed_s: float, now_s: float) -> str:
    """Return the present state of the demo as one line."""
    m = values.modbus
    return (
        f"{elapsed_s:5.0f} s  {m.get('state', '…'):<9}  {FORCE_LABEL} {format_force(values):<17}"
        f"  CAN {format_number(value_or_nan(values.can, 'force'), '.3f', 'N')}"
        f"  applied {format_number(value_or_nan(values.truth, 'force_n'), '.3f', 'N')}"
        f"  pressure {format_number(value_or_nan(m, 'pressure'), '.3f', 'kPa')}"
        f"  R_i {format_number(value_or_nan(m, 'radius'), '.3f', 'mm')}"
        f"  setpoint {format_number(value_or_nan(m, 'setpoint'), '.3f', 'kPa')}"
        f"  contacts {m.get('contact_counter', 0)}"
        f"  modbus {values.polls.per_s(now_s)}/s  can {values.frames.per_s(now_s)}/s"
    )


def panel(
    values: ObservedValues,
    ports: DemoPorts,
    control_port: int,
    events: Sequence[str],
    elapsed_s: float,
    now_s: float,
) -> RenderableType:
    """Return the panel. The panel fits a terminal of 80 × 24 characters."""
    return Group(
        Panel(
            Group(_numbers(values, now_s), _curves(values)),
            title="pneuforce demo · simulated rig",
            subtitle=f"{elapsed_s:.0f} s",
        ),
        Panel(Text("\n".join(events), no_wrap=True, overflow="ellipsis"), title="events"),
        Panel(_second_terminal(ports, control_port), title="in a second terminal"),
    )


def _numbers(values: ObservedValues, now_s: float) -> RenderableType:
    m = values.modbus
    peak = format_number(value_or_nan(m, "peak_force"), ".2f", "N")
    left: Rows = (
        (FORCE_LABEL, Text(format_force(values), style="bold cyan")),
        ("applied (truth)", format_number(value_or_nan(values.truth, "force_n"), "6.3f", "N")),
        ("pressure", format_number(value_or_nan(m, "pressure"), "6.3f", "kPa")),
        ("ΔP_i · rise", _pair(m, "baseline_pressure", "rise")),
        ("force on CAN", format_number(value_or_nan(values.can, "force"), "6.3f", "N")),
    )
    right: Rows = (
        ("state", Text(str(m.get("state", "…")), style=_state_style(m))),
        ("setpoint", format_number(value_or_nan(m, "setpoint"), ".3f", "kPa")),
        ("R_i", format_number(value_or_nan(m, "radius"), ".3f", "mm")),
        ("contacts", f"{m.get('contact_counter', 0)}, peak {peak}"),
        ("traffic", f"{values.polls.per_s(now_s)} polls/s, {values.frames.per_s(now_s)} CAN/s"),
    )
    grid = Table.grid(padding=(0, 2))
    for width in COLUMN_WIDTHS:
        grid.add_column(width=width, no_wrap=True)
    for (name, value), (right_name, right_value) in zip(left, right, strict=True):
        grid.add_row(name, value, right_name, right_value)
    return grid


def _curves(values: ObservedValues) -> RenderableType:
    curves = Table.grid(padding=(0, 1))
    for width in (8, SPARKLINE_WIDTH, 8):
        curves.add_column(width=width, no_wrap=True)
    history = tuple(values.history)  # a copy, because another thread adds values
    forces = [force for _, force, _ in history]
    pressures = [pressure for _, _, pressure in history]
    curves.add_row("force", Text(sparkline(forces, 0.0, 3.5), style="cyan"), "0–3.5 N")
    curves.add_row("pressure", Text(sparkline(pressures, 4.0, 14.0), style="green"), "4–14 kPa")
    return curves


def _pair(m: dict[str, object], first: str, second: str) -> str:
    values = format_number(value_or_nan(m, first), "6.3f", "kPa")
    return f"{values} · {format_number(value_or_nan(m, second), '.2f', 'kPa')}"


def _state_style(m: dict[str, object]) -> str:
    return {"holding": "bold green", "tripped": "bold red"}.get(str(m.get("state")), "bold yellow")


def _program_to_type(program: Path) -> str:
    """Return the shortest text that starts this program from a shell in the current folder."""
    if program.name != "pneuforce":
        return f"{sys.executable} -m pneuforce"
    if shutil.which("pneuforce") == str(program):
        return "pneuforce"
    return str(program.relative_to(Path.cwd())) if program.is_relative_to(Path.cwd()) else str(program)


def _second_terminal(ports: DemoPorts, control_port: int) -> Text:
    """Return commands that a user can try in a second terminal while the demo runs."""
    program = _program_to_type(Path(sys.argv[0]))
    modbus_option = "" if ports.modbus == 5020 else f" --port {ports.modbus}"
    can_option = "" if ports.can == 29536 else f" --port {ports.can}"
    return Text(
        f"browser     {ports.url}\n"
        f"as a PLC    {program} watch modbus{modbus_option}\n"
        f"as a robot  {program} watch can{can_option}\n"
        f"setpoint    mbpoll -m tcp -p {ports.modbus} -0 -B -1 -t 4:float -r 512 127.0.0.1 6.5\n"
        f"vent        mbpoll -m tcp -p {ports.modbus} -0 -1 -r 516 127.0.0.1 0\n"
        f"a fault     {program} sim fault leak --control-port {control_port}\n"
        "end         Ctrl-C here         (mbpoll: apt-get install mbpoll)"
    )
