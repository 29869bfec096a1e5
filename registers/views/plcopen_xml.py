"""Structured Text library as PLCopen XML (TC6 XML, version 2.01), which PLC systems import in one step.

Source: PLCopen, XML Formats for IEC 61131-3, version 2.01. The file validates against its schema.
"""

from __future__ import annotations

from xml.etree import ElementTree as Xml

from pneuforce.registers.map import MAP_VERSION
from pneuforce.registers.views import structured_text
from pneuforce.registers.views.st_declarations import Block, Variable, parse_library

_NAMESPACE = "http://www.plcopen.org/xml/tc6_0201"
_XHTML = "http://www.w3.org/1999/xhtml"
_ELEMENTARY = {"BOOL", "INT", "DINT", "UINT", "WORD", "DWORD", "REAL", "TIME"}
_SECTIONS = {"VAR_INPUT": "inputVars", "VAR_OUTPUT": "outputVars", "VAR": "localVars"}
#: The schema requires a date. A constant date keeps the file equal while the library is equal.
_DATE = "2026-01-01T00:00:00"


def render() -> str:
    """Return the XML file with all constants, types and function blocks of the library."""
    library = parse_library(structured_text.render())
    project = Xml.Element("project", {"xmlns": _NAMESPACE, "xmlns:xhtml": _XHTML})
    header = {"companyName": "pneuforce", "productName": "pneuforce", "productVersion": str(MAP_VERSION)}
    Xml.SubElement(project, "fileHeader", {**header, "creationDateTime": _DATE})
    _add_content_header(project)
    types = Xml.SubElement(project, "types")
    data_types = Xml.SubElement(types, "dataTypes")
    for array in library.arrays:
        base = _add_data_type(data_types, array.name)
        made = Xml.SubElement(base, "array")
        Xml.SubElement(made, "dimension", {"lower": str(array.first), "upper": str(array.last)})
        _add_type(Xml.SubElement(made, "baseType"), array.element)
    for structure in library.structures:
        members = Xml.SubElement(_add_data_type(data_types, structure.name), "struct")
        _add_variables(members, structure.members)
    pous = Xml.SubElement(types, "pous")
    for block in library.blocks:
        _add_block(pous, block)
    configurations = Xml.SubElement(Xml.SubElement(project, "instances"), "configurations")
    configuration = Xml.SubElement(configurations, "configuration", {"name": "pneuforce"})
    resource = Xml.SubElement(configuration, "resource", {"name": "pneuforce_constants"})
    constants = Xml.SubElement(resource, "globalVars", {"constant": "true"})
    _add_variables(constants, library.constants)
    Xml.indent(project)
    return '<?xml version="1.0" encoding="utf-8"?>\n' + Xml.tostring(project, encoding="unicode") + "\n"


def _add_content_header(project: Xml.Element) -> None:
    """Add the header. The schema requires a scale for each graphical language."""
    content = Xml.SubElement(project, "contentHeader", {"name": "pneuforce"})
    coordinates = Xml.SubElement(content, "coordinateInfo")
    for language in ("fbd", "ld", "sfc"):
        Xml.SubElement(Xml.SubElement(coordinates, language), "scaling", {"x": "1", "y": "1"})


def _add_data_type(parent: Xml.Element, name: str) -> Xml.Element:
    return Xml.SubElement(Xml.SubElement(parent, "dataType", {"name": name}), "baseType")


def _add_type(parent: Xml.Element, name: str) -> None:
    if name in _ELEMENTARY:
        Xml.SubElement(parent, name)
    else:
        Xml.SubElement(parent, "derived", {"name": name})


def _add_variables(parent: Xml.Element, variables: list[Variable]) -> None:
    for variable in variables:
        made = Xml.SubElement(parent, "variable", {"name": variable.name})
        _add_type(Xml.SubElement(made, "type"), variable.type)
        if variable.initial:
            initial = Xml.SubElement(made, "initialValue")
            Xml.SubElement(initial, "simpleValue", {"value": variable.initial})
        if variable.doc:
            _add_text(Xml.SubElement(made, "documentation"), variable.doc)


def _add_text(parent: Xml.Element, text: str) -> None:
    Xml.SubElement(parent, "xhtml:p").text = text


def _add_block(pous: Xml.Element, block: Block) -> None:
    pou = Xml.SubElement(pous, "pou", {"name": block.name, "pouType": "functionBlock"})
    interface = Xml.SubElement(pou, "interface")
    for keyword, variables in block.sections.items():
        name, _, constant = keyword.partition(" ")
        attributes = {"constant": "true"} if constant else {}
        _add_variables(Xml.SubElement(interface, _SECTIONS[name], attributes), variables)
    _add_text(Xml.SubElement(Xml.SubElement(pou, "body"), "ST"), block.body)
    _add_text(Xml.SubElement(pou, "documentation"), block.doc)
