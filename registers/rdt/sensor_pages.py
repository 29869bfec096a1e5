"""XML pages with which clients of ATI sensors read the scale and the units: netftapi2.xml, netftcalapi.xml.

The names of the elements are those of ATI's manual 9610-05-Ethernet Axia-09, section 11. The names of the
roots are those that the driver ros2_net_ft_driver expects; other clients ignore them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from xml.sax.saxutils import escape

from pneuforce.registers.rdt.record import COUNTS_PER_N, COUNTS_PER_NM, RATE_HZ

PRODUCT = "pneuforce PF-1"


def settings_page(serial_number: int, simulated: bool) -> str:
    """Return netftapi2.xml: product, scale, units, and settings of RDT."""
    elements = {
        "prodname": f"{PRODUCT} (simulated)" if simulated else PRODUCT,
        "mfgdigsn": serial_number,
        "setrate": RATE_HZ,
        "cfgcpf": COUNTS_PER_N,
        "cfgcpt": COUNTS_PER_NM,
        "scfgfu": "N",
        "scfgtu": "N-m",
        "comrdte": "Enabled",
        "comrdtrate": RATE_HZ,
        "comrdtbsiz": 1,
    }
    return _xml("netft", elements)


def calibration_page(serial_number: int, simulated: bool) -> str:  # noqa: ARG001
    """Return netftcalapi.xml: scale and units of the calibration."""
    elements = {
        "calsn": serial_number,
        "scalfu": "N",
        "scaltu": "N-m",
        "calcpf": COUNTS_PER_N,
        "calcpt": COUNTS_PER_NM,
    }
    return _xml("netftCalibration", elements)


#: Pages by path. The arguments are the serial number, and whether the rig is simulated.
SENSOR_PAGES: Mapping[str, Callable[[int, bool], str]] = {
    "/netftapi2.xml": settings_page,
    "/netftcalapi.xml": calibration_page,
}


def _xml(root: str, elements: Mapping[str, object]) -> str:
    lines = (f"<{name}>{escape(str(value))}</{name}>" for name, value in elements.items())
    return "\n".join(['<?xml version="1.0" encoding="UTF-8"?>', f"<{root}>", *lines, f"</{root}>", ""])
