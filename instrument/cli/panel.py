"""The live panel of the demo, and its one line a second where there is no terminal."""

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

from instrument.cli.observe import Seen, number

Rows = tuple[tuple[str, RenderableType], ...]
BLOCKS = " ▁▂▃▄▅▆▇█"
SPARK_WIDTH = 56
COLUMNS = (15, 22, 8, 25)  #: of the numbers: with their gaps they fill 80
EVENTS = 3


@dataclass(frozen=True, slots=True)
class Ports:
    """Where the demo's buses and its page are."""

    modbus: int = 5020
    can: int = 29536
    page: int = 8080
    token: str = ""  #: what the page's operator has to know

    @property
    def url(self) -> str:
        """The page, for its operator."""
        return f"http://127.0.0.1:{self.page}/#operator={self.token}"


def shown(value: float, form: str, unit: str) -> str:
    """A number with its unit, or a dash as wide where it is not available."""
    number_text = f"{value:{form}}" if math.isfinite(value) else "–".rjust(len(f"{0.0:{form}}"))
    return f"{number_text} {unit}"


def spark(values: Sequence[float], low: float, high: float, width: int = SPARK_WIDTH) -> str:
    """A line of blocks, the latest at its right end; a gap where a value is not available."""
    picked = values[-width * (len(values) // width or 1) :: len(values) // width or 1][-width:]
    return "".join(_block(value, low, high) for value in picked).rjust(width)


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


def panel(
    seen: Seen, ports: Ports, control_port: int, events: Sequence[str], elapsed_s: float, now_s: float
) -> RenderableType:
    """The whole panel; it fits a terminal of 80 × 24."""
    return Group(
        Panel(
            Group(_numbers(seen, now_s), _curves(seen)),
            title="pneuforce demo · simulated rig",
            subtitle=f"{elapsed_s:.0f} s",
        ),
        Panel(Text("\n".join(events), no_wrap=True, overflow="ellipsis"), title="events"),
        Panel(_second_terminal(ports, control_port), title="in a second terminal"),
    )


def _numbers(seen: Seen, now_s: float) -> RenderableType:
    m = seen.modbus
    left: Rows = (
        ("force", Text(force_text(seen), style="bold cyan")),
        ("applied (truth)", shown(number(seen.truth, "force_n"), "6.3f", "N")),
        ("pressure", shown(number(m, "pressure"), "6.3f", "kPa")),
        ("ΔP_i · rise", _pair(m, "initial_pressure", "rise")),
        ("force on CAN", shown(number(seen.can, "force"), "6.3f", "N")),
    )
    right: Rows = (
        ("state", Text(str(m.get("state", "…")), style=_state_style(m))),
        ("setpoint", shown(number(m, "setpoint"), ".3f", "kPa")),
        ("R_i", shown(number(m, "radius"), ".3f", "mm")),
        ("contacts", f"{m.get('contact_counter', 0)}, peak {shown(number(m, 'peak_force'), '.2f', 'N')}"),
        ("traffic", f"{seen.polls.per_s(now_s)} polls/s, {seen.frames.per_s(now_s)} CAN/s"),
    )
    grid = Table.grid(padding=(0, 2))
    for width in COLUMNS:
        grid.add_column(width=width, no_wrap=True)
    for (name, value), (other, other_value) in zip(left, right, strict=True):
        grid.add_row(name, value, other, other_value)
    return grid


def _curves(seen: Seen) -> RenderableType:
    curves = Table.grid(padding=(0, 1))
    for width in (8, SPARK_WIDTH, 8):
        curves.add_column(width=width, no_wrap=True)
    seen_so_far = tuple(seen.history)  # another thread adds to it meanwhile
    forces = [force for _, force, _ in seen_so_far]
    pressures = [pressure for _, _, pressure in seen_so_far]
    curves.add_row("force", Text(spark(forces, 0.0, 3.5), style="cyan"), "0–3.5 N")
    curves.add_row("pressure", Text(spark(pressures, 4.0, 14.0), style="green"), "4–14 kPa")
    return curves


def _pair(m: dict[str, object], first: str, second: str) -> str:
    return f"{shown(number(m, first), '6.3f', 'kPa')} · {shown(number(m, second), '.2f', 'kPa')}"


def _state_style(m: dict[str, object]) -> str:
    return {"holding": "bold green", "tripped": "bold red"}.get(str(m.get("state")), "bold yellow")


def _typed(program: Path) -> str:
    """What to type for this program: as short as it may be where one is."""
    if program.name != "pneuforce":
        return f"{sys.executable} -m instrument"
    if shutil.which("pneuforce") == str(program):
        return "pneuforce"
    return str(program.relative_to(Path.cwd())) if program.is_relative_to(Path.cwd()) else str(program)


def _second_terminal(ports: Ports, control_port: int) -> Text:
    watch = "" if ports.modbus == 5020 else f" --port {ports.modbus}"
    program = _typed(Path(sys.argv[0]))
    watch_can = "" if ports.can == 29536 else f" --port {ports.can}"
    return Text(
        f"browser     {ports.url}\n"
        f"as a PLC    {program} watch modbus{watch}\n"
        f"as a robot  {program} watch can{watch_can}\n"
        f"go to 6.5   mbpoll -m tcp -p {ports.modbus} -0 -B -1 -t 4:float -r 512 127.0.0.1 6.5\n"
        f"vent        mbpoll -m tcp -p {ports.modbus} -0 -1 -r 516 127.0.0.1 0\n"
        f"a fault     {program} fault leak --control {control_port}\n"
        "end         Ctrl-C here         (mbpoll: apt-get install mbpoll)"
    )
