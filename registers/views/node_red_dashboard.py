"""Flow for Node-RED with a dashboard: the flow of `node_red`, and a tab with @flowfuse/node-red-dashboard."""

from __future__ import annotations

from typing import Any

from pneuforce.registers.map import BY_NAME
from pneuforce.registers.views.node_red import flow
from pneuforce.registers.views.node_red_nodes import (
    JAVASCRIPT,
    Node,
    Point,
    Wires,
    configuration,
    link_in,
    link_out,
    node_id,
    placed,
    render_nodes,
    tab,
)
from pneuforce.registers.views.node_red_tables import FORCE_LIMIT_N, LIMITED, SETPOINT_KPA

_TAB = "pneuforce dashboard"
_HELP = """\
Page with the force, the faults and the buttons, at the address /dashboard/pneuforce of Node-RED.
Needs the package @flowfuse/node-red-dashboard. Generated: pneuforce map --format node-red-dashboard.
"""
_RED, _BLUE = "#c00000", "#0d74ce"


def render() -> str:
    """Return the flow and its dashboard."""
    return render_nodes([*flow(("Page reading",), ("Page note",), ("Page command",)), *_page(), *_widgets()])


def _page() -> list[Node]:
    """Return the tab, and the configuration nodes of the page."""
    base = {"path": "/dashboard", "includeClientData": True, "showDisconnectNotification": True}
    colors = {
        "surface": "#ffffff",
        "primary": _BLUE,
        "bgPage": "#eeeeee",
        "groupBg": "#ffffff",
        "groupOutline": "#cccccc",
    }
    sizes = {"pagePadding": "12px", "groupGap": "12px", "groupBorderRadius": "4px", "widgetGap": "12px"}
    page = {
        "ui": node_id("ui-base Dashboard"),
        "theme": node_id("ui-theme Theme"),
        "path": "/pneuforce",
        "layout": "grid",
    }
    return [
        tab(_TAB, _HELP),
        configuration("ui-base", "Dashboard", **base),
        configuration("ui-theme", "Theme", colors=colors, sizes=sizes),
        configuration(
            "ui-page", "pneuforce", **page, icon="gauge", order=1, visible="true", disabled="false"
        ),
        _group("Force", 1),
        _group("Operation", 2),
    ]


def _group(name: str, order: int) -> Node:
    settings = {"width": "6", "height": "1", "showTitle": True, "visible": "true", "disabled": "false"}
    return configuration("ui-group", name, page=node_id("ui-page pneuforce"), order=order, **settings)


def _widgets() -> list[Node]:
    text: Node = {"label": "", "format": "{{msg.payload}}", "layout": "row-left", "wrapText": True}
    return [
        link_in("Page reading", (105, 80), ("Reading",), ("Force on the page",), _TAB),
        _template("Force on the page", (300, 80)),
        link_in("Page note", (105, 140), ("Note",), ("Notes on the page",), _TAB),
        _widget("ui-text", "Notes on the page", (300, 140), (), "Operation", 6, value="payload", **text),
        _button("Vent", "vent", (160, 220), 1, _RED),
        _number("Setpoint [kPa]", "setpoint", (160, 260), 2, SETPOINT_KPA),
        _number("Force limit [N]", "force_limit", (160, 300), 3, FORCE_LIMIT_N),
        _button("Hold", "hold", (160, 340), 4, _BLUE),
        _button("Clear faults", "clear", (160, 380), 5, _BLUE),
        link_out("Page command", (395, 300), ("Command",), _TAB),
    ]


def _widget(kind: str, name: str, at: Point, wires: Wires, group: str, order: int, **settings: Any) -> Node:
    place: Node = {"group": node_id(f"ui-group {group}"), "order": order, "width": 0, "height": 0}
    return placed(kind, name, at, wires, _TAB, **place, **settings)


def _template(name: str, at: Point) -> Node:
    """Return the widget that shows a reading. After a reload, it shows none until the next reading."""
    keys = ("storeOutMessages", "passthru", "resendOnRefresh")
    text = (JAVASCRIPT / "reading.vue").read_text(encoding="utf-8")
    settings: Node = {"format": text, "templateScope": "local", **dict.fromkeys(keys, False)}
    return _widget("ui-template", name, at, ((),), "Force", 1, **settings)


def _button(label: str, topic: str, at: Point, order: int, color: str) -> Node:
    colors: Node = {"buttonColor": color, "textColor": "#ffffff", "iconColor": ""}
    settings: Node = {"icon": "", "iconPosition": "left", "enableClick": True, "payloadType": "str"}
    return _command("ui-button", label, topic, at, order, payload="", **settings, **colors)


def _number(label: str, topic: str, at: Point, order: int, value: float) -> Node:
    """Return an input for a number. It sends a new value when the operator leaves the input."""
    register = BY_NAME[LIMITED[topic]]
    limits: Node = {"min": register.low, "max": register.high, "step": 0.1}
    sending: Node = {"passthru": False, "sendOnBlur": True, "sendOnEnter": True, "sendOnDelay": False}
    shown: Node = {"icon": "", "iconPosition": "left", "iconInnerPosition": "inside", "spinner": "default"}
    label = f"{label}, at first {value:g}"
    return _command("ui-number-input", label, topic, at, order, **limits, **sending, **shown)


def _command(kind: str, label: str, topic: str, at: Point, order: int, **settings: Any) -> Node:
    wires, name = (("Page command",),), f"{label} ({kind})"
    texts = {"label": label, "topic": topic, "topicType": "str"}
    return _widget(kind, name, at, wires, "Operation", order, **texts, **settings)
