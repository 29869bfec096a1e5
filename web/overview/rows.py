"""Rows of the overview: one instrument each, as JSON and as HTML."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from html import escape
from typing import Any

from pneuforce.web.operator_texts import FAULT_TITLES
from pneuforce.web.overview.watched_instrument import WatchedInstrument

REFRESH_S = 2
#: Status bits that a person must see, in the order of their importance, with the class of their colour.
MARKS = (
    ("force_high_alarm", "above the force limit", "bad"),
    ("force_high_alarm_2", "above the second force limit", "bad"),
    ("maintenance_required", "maintenance required", "warning"),
    ("simulated", "simulated", "warning"),
)

_PAGE = """<!doctype html>
<html lang="en">
<head>
  <meta charset="utf-8">
  <meta name="viewport" content="width=device-width, initial-scale=1">
  <meta http-equiv="refresh" content="{refresh_s}">
  <title>{title}</title>
  <link rel="stylesheet" href="/static/colours.css">
  <link rel="stylesheet" href="/static/overview.css">
</head>
<body>
  <h1>{title}</h1>
  <table>
    <thead>
      <tr><th scope="col">Instrument<th scope="col">State<th scope="col">Force<th scope="col">Pressure</tr>
    </thead>
    <tbody>{rows}</tbody>
  </table>
  <p>Renewed every {refresh_s} s. To vent, open the page of the instrument.</p>
</body>
</html>
"""


def row(instrument: WatchedInstrument, now_s: float) -> dict[str, Any]:
    """Return the state of an instrument. The force is null if it is not valid."""
    state, header = instrument.state(now_s), instrument.header
    facts = {
        "name": instrument.name,
        "serial_number": header.get("serial_number"),
        "version": header.get("version"),
        "web_port": instrument.web_port,
        "web_scheme": instrument.web_scheme,
        "reachable": state is not None,
        "reason": None if state is not None else instrument.reason,
    }
    if state is None:
        return facts
    status = state["status"]
    return facts | {
        "state": state["state"],
        "status": sorted(status),
        "maintenance_causes": sorted(state.get("maintenance_causes", ())),
        "faults": [FAULT_TITLES.get(code, f"fault {code}") for code in state["faults"]],
        "force_n": state["force_n"] if "force_valid" in status else None,
        "force_std_n": state["force_std_n"] if "force_valid" in status else None,
        "pressure_kpa": state["pressure_kpa"],
    }


def page(rows: Iterable[Mapping[str, Any]], host: str) -> str:
    """Return the page. `host` is the name of this computer in the links to the pages of the instruments."""
    shown = list(rows)
    failed = sum(bool(each["reason"] or each["faults"]) for each in shown)
    instruments = "1 instrument" if len(shown) == 1 else f"{len(shown)} instruments"
    title = f"{instruments}, {failed} with a latched fault or without data" if failed else instruments
    return _PAGE.format(
        title=title, refresh_s=REFRESH_S, rows="".join(_html_row(each, host) for each in shown)
    )


def _html_row(facts: Mapping[str, Any], host: str) -> str:
    name = escape(facts["name"])
    if facts["web_port"]:
        url = f"{facts['web_scheme']}://{escape(host, quote=True)}:{facts['web_port']}/"
        name = f'<a href="{url}">{name}</a>'
    if facts["reason"]:
        return (
            f'<tr class="bad"><th scope="row">{name}<td colspan="3">no data: {escape(facts["reason"])}</tr>'
        )
    # A latched fault can be in the past: its cause may have gone.
    marks = [("bad", f"latched fault: {fault}") for fault in facts["faults"]]
    causes = ", ".join(facts["maintenance_causes"]).replace("_", " ")
    texts = {"maintenance_required": f"maintenance required: {causes}"} if causes else {}
    marks += [(colour, texts.get(bit, text)) for bit, text, colour in MARKS if bit in facts["status"]]
    notes = "".join(f' <span class="{colour}">{escape(text)}</span>' for colour, text in marks)
    force = "no force"
    if facts["force_n"] is not None:
        force = f"{facts['force_n']:z.2f} ± {facts['force_std_n'] or 0:.2f} N"
    pressure = "no pressure" if facts["pressure_kpa"] is None else f"{facts['pressure_kpa']:z.2f} kPa"
    colour = ' class="bad"' if facts["faults"] else ""
    return (
        f'<tr{colour}><th scope="row">{name}<td>{escape(facts["state"])}{notes}'
        f'<td class="number">{force}<td class="number">{pressure}</tr>'
    )
