"""Translation of expressions and variables to Python, with the type of each result."""

import re

from blark import transform as tree

from tests.registers.views.structured_text.data_types import ArrayType, BlockType, StructureType
from tests.registers.views.structured_text.elementary import (
    ANY_INT,
    ANY_REAL,
    ARITHMETIC,
    COMPARISONS,
    LITERALS,
    LOGIC,
    TYPES,
    PlcError,
    common,
    fits,
)

_CONVERSION = re.compile(r"([A-Z]+)_TO_([A-Z]+)")
_BOOL, _TIME = TYPES["BOOL"], TYPES["TIME"]
_UNITS_MS = {"days": 86_400_000, "hours": 3_600_000, "minutes": 60_000, "seconds": 1000, "milliseconds": 1}


class Expressions:
    """Translator of the expressions of one block. Each method returns the Python expression and its type."""

    def __init__(self):
        self.variables, self.sections = {}, {}

    def condition(self, expression):
        return self.converted(*self.expression(expression), _BOOL)

    def place(self, variable, assigned=False):
        """Return the Python expression and the type of a variable, an element or a member."""
        elements = getattr(variable, "elements", [])
        name = str(variable.name).upper()
        if name not in self.variables:
            raise PlcError(f"unknown variable {variable}")
        if assigned and (self.sections[name] in ("CONSTANT", "VAR_INPUT")):
            raise PlcError(f"{variable} is not writable")
        code, type_ = f"self.{name}", self.variables[name]
        for element in elements:
            code, type_ = self.part(code, type_, element, assigned)
        return code, type_

    def part(self, code, type_, element, assigned):
        if isinstance(element, tree.SubscriptList) and isinstance(type_, ArrayType):
            [subscript] = element.subscripts
            at, _ = self.expression(subscript)
            return f"{code}[element({at}, {type_.first}, {type_.last})]", type_.element
        if isinstance(element, tree.FieldSelector):
            name = str(element.field).upper()
            members = type_.members if isinstance(type_, StructureType) else getattr(type_, "readable", {})
            if name in members and not (assigned and isinstance(type_, BlockType)):
                return f"{code}.{name}", members[name]
        raise PlcError(f"{element} is no part of {code}")

    def expression(self, node):
        """Return the Python expression and the type of an expression."""
        return getattr(self, f"of_{type(node).__name__}", self.unknown)(node)

    def unknown(self, node):
        raise PlcError(f"unknown expression {type(node).__name__}: {node}")

    def of_SimpleVariable(self, node):  # noqa: N802
        return self.place(node)

    of_MultiElementVariable = of_SimpleVariable  # noqa: N815

    def of_ParenthesizedExpression(self, node):  # noqa: N802
        code, type_ = self.expression(node.expr)
        return f"({code})", type_

    def of_Boolean(self, node):  # noqa: N802
        return str(str(node.value).upper() == "TRUE"), _BOOL

    def of_Integer(self, node):  # noqa: N802
        return str(int(str(node.value).replace("_", ""))), self.literal_type(node, ANY_INT)

    def of_Real(self, node):  # noqa: N802
        return repr(float(str(node.value))), self.literal_type(node, ANY_REAL)

    def of_BitString(self, node):  # noqa: N802
        return str(int(str(node.value).replace("_", ""), node.base)), self.literal_type(node, ANY_INT)

    of_HexBitString = of_BitString  # noqa: N815

    def literal_type(self, node, without):
        if not node.type_name:
            return without
        type_ = TYPES[node.type_name.upper()]
        if type_.kind == "bits" and int(str(node.value), node.base) >> type_.bits:
            raise PlcError(f"{node} does not fit into {type_.name}")
        return type_

    def of_Duration(self, node):  # noqa: N802
        total_ms = sum(float(getattr(node, unit) or 0) * ms for unit, ms in _UNITS_MS.items())
        return str(round(-total_ms if node.negative else total_ms)), _TIME

    def of_String(self, node):  # noqa: N802
        return repr(str(node.value).strip("'")), TYPES["STRING"]

    def of_UnaryOperation(self, node):  # noqa: N802
        code, type_ = self.expression(node.expr)
        operator = str(node.op).upper()
        if operator == "NOT" and type_.kind in ("bool", "bits"):
            return f"as_{type_.name}(~{code})" if type_.kind == "bits" else f"(not {code})", type_
        if operator == "-" and (type_ in LITERALS or type_.kind == "real" or type_.signed):
            return self.rounded(f"-{code}", type_), type_
        raise PlcError(f"{operator} {type_.name}")

    def of_BinaryOperation(self, node):  # noqa: N802
        operator = str(node.op).upper()
        (left, left_type), (right, right_type) = self.expression(node.left), self.expression(node.right)
        type_ = common(left_type, right_type)
        left, right = self.converted(left, left_type, type_), self.converted(right, right_type, type_)
        if operator in LOGIC:
            if type_.kind not in ("bool", "bits"):
                raise PlcError(f"{operator} needs bits, not {type_.name}")
            return f"({left} {'^' if operator == 'XOR' else '|' if operator == 'OR' else '&'} {right})", type_
        if operator in COMPARISONS:
            python = {"=": "==", "<>": "!="}.get(operator, operator)
            return f"({left} {python} {right})", _BOOL
        if operator not in ARITHMETIC or type_.kind not in ("integer", "real", "time"):
            raise PlcError(f"{operator} needs numbers, not {type_.name}")
        if operator in ("/", "MOD"):
            name = "divide" if operator == "/" else "modulo"
            return self.rounded(f"{name}({type_.kind!r}, {left}, {right})", type_), type_
        return self.rounded(f"({left} {operator} {right})", type_), type_

    def rounded(self, code, type_):
        return f"({code})" if type_ in LITERALS else f"as_{type_.name}({code})"

    def converted(self, code, given, type_):
        if given is type_ or (type_ in LITERALS and fits(given, type_)):
            return code
        if not isinstance(given, type(type_)) or not fits(given, type_):
            raise PlcError(f"{code} is {getattr(given, 'name', given)}, not {getattr(type_, 'name', type_)}")
        if given is ANY_INT and type_.kind != "real" and type_.value(int(eval(code))) != int(eval(code)):
            raise PlcError(f"{code} does not fit into {type_.name}")
        return f"as_{type_.name}({code})" if given not in LITERALS else repr(type_.value(eval(code)))

    def of_FunctionCall(self, node):  # noqa: N802
        name = str(node.name).upper()
        arguments = [self.expression(parameter.value) for parameter in node.parameters]
        if name in ("SHL", "SHR"):
            (code, type_), (count, count_type) = arguments
            if type_.kind != "bits" or count_type.kind != "integer":
                raise PlcError(f"{node}")
            return f"as_{type_.name}({code} {'<<' if name == 'SHL' else '>>'} {count})", type_
        match = _CONVERSION.fullmatch(name)
        if not match or not set(match.groups()) <= TYPES.keys():
            raise PlcError(f"unknown function {name}")
        source, target = match.groups()
        [(code, type_)] = arguments
        code = self.converted(code, type_, TYPES[source])
        return f"convert(TYPES[{source!r}], TYPES[{target!r}], {code})", TYPES[target]
