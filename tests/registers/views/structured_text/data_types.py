"""Arrays, structures and function blocks of Structured Text as types."""

from dataclasses import dataclass, field
from types import SimpleNamespace

from blark import transform as tree

from tests.registers.views.structured_text.elementary import TYPES
from tests.registers.views.structured_text.standard_blocks import STANDARD_BLOCKS


@dataclass(frozen=True)
class ArrayType:
    """Array with one dimension of an elementary type. Arrays with equal elements and limits are equal."""

    name: str = field(compare=False)
    element: object
    first: int
    last: int

    def initial(self, _=None):
        return [self.element.value(0)] * (self.last - self.first + 1)


@dataclass(frozen=True)
class StructureType:
    """Structure with members of elementary types."""

    name: str
    members: dict

    def initial(self, _=None):
        return SimpleNamespace(**{name: type_.value(0) for name, type_ in self.members.items()})


@dataclass(frozen=True)
class BlockType:
    """Function block. Another block can read the variables `readable`, and assign the variables `inputs`."""

    name: str
    readable: dict
    inputs: dict
    create: object

    def initial(self, _=None):
        return self.create()


def standard_blocks():
    """Return the types of the standard function blocks."""
    blocks = {}
    for name, block in STANDARD_BLOCKS.items():
        types = {variable: TYPES[type_] for variable, type_ in block.TYPES.items()}
        inputs = {variable: types[variable] for variable in ("IN", "PT", "CLK") if variable in types}
        blocks[name] = BlockType(name, types, inputs, block)
    return blocks


def array_type(name, spec, types):
    """Return the type of an array with one dimension. An array without a named type has the name ""."""
    [subrange] = spec.subranges
    element = types[spec.type.type_name.upper()]
    return ArrayType(name, element, int(str(subrange.start)), int(str(subrange.stop)))


def data_type(declaration, types):
    """Return the array or structure of a TYPE declaration."""
    name = declaration.name.upper()
    if isinstance(declaration, tree.ArrayTypeDeclaration):
        return array_type(name, declaration.init.spec, types)
    members = {}
    for item in declaration.declarations:
        for variable in item.variables:
            members[variable.variable.name.upper()] = types[str(item.init.spec).upper()]
    return StructureType(name, members)
