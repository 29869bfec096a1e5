"""Documents generated from the register map and the CAN frames. A pure function renders each document."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from pneuforce.registers.views import (
    c_header,
    dbc,
    eds,
    faults_page,
    grafana_dashboard,
    map_files_page,
    markdown,
    metrics_page,
    mqtt_page,
    node_red,
    node_red_dashboard,
    object_table,
    plcopen_xml,
    prometheus_rules,
    siemens_scl,
    structured_text,
    table_csv,
    tree_json,
)


class View(NamedTuple):
    """Generated document."""

    render: Callable[[], str]
    path: str  #: path of the committed copy, relative to the root of the repository
    #: Render for a CAN node id. None: the document is the same for each node id.
    render_node: Callable[[int], str] | None = None


#: Documents by the names that `pneuforce map --format` accepts.
VIEWS = {
    "md": View(markdown.render, "docs/registers.md"),
    "faults": View(faults_page.render, "docs/faults.md"),
    "csv": View(table_csv.render, "docs/registers.csv", table_csv.render),
    "json": View(tree_json.render, "docs/registers.json"),
    "map-files": View(map_files_page.render, "docs/reference/map-files.md"),
    "dbc": View(dbc.render, "docs/pneuforce.dbc", dbc.render),
    "eds": View(eds.render, "docs/pneuforce.eds"),
    "objects": View(object_table.render, "docs/canopen-objects.md"),
    "st": View(structured_text.render, "docs/plc/pneuforce.st"),
    "scl": View(siemens_scl.render, "docs/plc/pneuforce.scl"),
    "plcopen": View(plcopen_xml.render, "docs/plc/pneuforce.xml"),
    "node-red": View(node_red.render, "docs/node-red/pneuforce-flow.json"),
    "node-red-dashboard": View(node_red_dashboard.render, "docs/node-red/pneuforce-dashboard.json"),
    "metrics": View(metrics_page.render, "docs/reference/metrics.md"),
    "mqtt": View(mqtt_page.render, "docs/reference/mqtt.md"),
    "prometheus-rules": View(prometheus_rules.render, "docs/prometheus/pneuforce.rules.yml"),
    "grafana": View(grafana_dashboard.render, "docs/prometheus/pneuforce-dashboard.json"),
    "h": View(c_header.render, "docs/plc/pneuforce_registers.h"),
}
