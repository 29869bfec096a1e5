"""Translation of a function block or program from its syntax tree to a Python class.

The translation is strict: a program that some PLCs reject, or run with another result, raises PlcError.
"""

from copy import copy

from blark import transform as tree

from tests.registers.views.structured_text.data_types import (
    ArrayType,
    BlockType,
    StructureType,
    array_type,
    data_type,
    standard_blocks,
)
from tests.registers.views.structured_text.elementary import TYPES, PlcError, convert, divide, modulo
from tests.registers.views.structured_text.expressions import Expressions
from tests.registers.views.structured_text.standard_blocks import STANDARD_BLOCKS

MAX_REPEATS = 10_000  #: repeats of one loop, after which a PLC would stop with a watchdog


def translated(declarations):
    """Return a dictionary from the name of each function block and program to its type."""
    types = {**TYPES, **standard_blocks()}
    for declaration in declarations:
        if isinstance(declaration, tree.DataTypeDeclaration):
            made = data_type(declaration.declaration, types)
        else:
            made = _Translator(declaration, types).block()
        types[made.name] = made
    return {name: type_ for name, type_ in types.items() if name not in STANDARD_BLOCKS}


class _Translator(Expressions):
    """Translator of one function block or program."""

    def __init__(self, declaration, types):
        super().__init__()
        self.declaration, self.types, self.initial = declaration, types, {}
        self.lines, self.loops = [], 0

    def block(self):
        for section in self.declaration.declarations:
            self.declare(section)
        self.statements(self.declaration.body, 1)
        source = "\n".join(["def cycle(self, now_ms):", *self.lines, "    return self"])
        names = {"convert": convert, "divide": divide, "modulo": modulo, "TYPES": TYPES}
        names |= {f"as_{name}": type_.value for name, type_ in TYPES.items()}
        names |= {"element": _element, "PlcError": PlcError}
        exec(compile(source, f"<{self.declaration.name}>", "exec"), names)
        return self.block_type(names["cycle"])

    def block_type(self, cycle):
        variables, initial = dict(self.variables), dict(self.initial)

        def prepare(instance):
            for name, type_ in variables.items():
                setattr(instance, name, copy(initial[name]) if name in initial else type_.initial())

        made = type(str(self.declaration.name), (), {"__init__": prepare, "cycle": cycle})
        made.TYPES = variables
        inputs, outputs = (
            {name: variables[name] for name, section in self.sections.items() if section == wanted}
            for wanted in ("VAR_INPUT", "VAR_OUTPUT")
        )
        return BlockType(self.declaration.name.upper(), inputs | outputs, inputs, made)

    def declare(self, section):
        kind = section.block_header
        constant = bool(section.attrs) and "CONSTANT" in str(section.attrs).upper()
        for item in section.items:
            type_ = self.type_of(item.init.spec)
            for variable in item.variables:
                name = variable.variable.name.upper()
                if name in self.variables:
                    raise PlcError(f"{name} is declared twice")
                self.variables[name] = type_
                self.sections[name] = "CONSTANT" if constant else kind
                self.set_initial(name, item.init.value)

    def type_of(self, spec):
        if isinstance(spec, tree.ArraySpecification):
            return array_type("", spec, self.types)
        if (name := str(spec).upper()) not in self.types:
            raise PlcError(f"unknown type {name}")
        return self.types[name]

    def set_initial(self, name, value):
        type_ = self.variables[name]
        if isinstance(value, tree.ArrayInitialization):
            numbers = str(value).strip("[]").split(",")
            self.initial[name] = [type_.element.value(int(number)) for number in numbers]
        elif value is not None:
            self.initial[name] = self.constant(value, type_)
        elif type_ in TYPES.values():
            self.initial[name] = type_.value(0)

    def constant(self, value, type_):
        code = self.converted(*self.expression(value), type_)
        return eval(code, {f"as_{name}": made.value for name, made in TYPES.items()})

    def line(self, depth, text):
        self.lines.append("    " * depth + text)

    def statements(self, body, depth):
        statements = body.statements if body is not None else []
        if not statements:
            self.line(depth, "pass")
        for statement in statements:
            handler = getattr(self, f"on_{type(statement).__name__}", None)
            if handler is None:
                raise PlcError(f"unknown statement {type(statement).__name__}: {statement}")
            handler(statement, depth)

    def on_AssignmentStatement(self, statement, depth):  # noqa: N802
        [variable] = statement.variables
        target, type_ = self.place(variable, assigned=True)
        self.assign(target, type_, statement.expression, depth)

    def assign(self, target, type_, expression, depth):
        code, given = self.expression(expression)
        if isinstance(type_, ArrayType | StructureType):
            if given != type_ or isinstance(type_, StructureType):
                raise PlcError(f"{expression} is not {type_.name}")
            self.line(depth, f"{target} = {code}[:]")
        else:
            self.line(depth, f"{target} = {self.converted(code, given, type_)}")

    def on_IfStatement(self, statement, depth):  # noqa: N802
        branches = [(statement.if_expression, statement.statements)]
        branches += [(branch.if_expression, branch.statements) for branch in statement.else_ifs]
        for number, (condition, body) in enumerate(branches):
            self.line(depth, f"{'elif' if number else 'if'} {self.condition(condition)}:")
            self.statements(body, depth + 1)
        self.otherwise(statement.else_clause, depth)

    def otherwise(self, clause, depth):
        if clause is not None:
            self.line(depth, "else:")
            self.statements(clause.statements, depth + 1)

    def on_CaseStatement(self, statement, depth):  # noqa: N802
        code, type_ = self.expression(statement.expression)
        if type_.kind != "integer":
            raise PlcError(f"CASE needs an integer, not {type_.name}")
        chosen = self.temporary()
        self.line(depth, f"{chosen} = {code}")
        for number, case in enumerate(statement.cases):
            tests = " or ".join(self.match(chosen, type_, match) for match in case.matches)
            self.line(depth, f"{'elif' if number else 'if'} {tests}:")
            self.statements(case.statements, depth + 1)
        self.otherwise(statement.else_clause, depth)

    def match(self, chosen, type_, match):
        if hasattr(match, "start"):
            first, last = (self.converted(*self.expression(end), type_) for end in (match.start, match.stop))
            return f"{first} <= {chosen} <= {last}"
        return f"{chosen} == {self.converted(*self.expression(match), type_)}"

    def temporary(self):
        self.loops += 1
        return f"_{self.loops}"

    def on_ForStatement(self, statement, depth):  # noqa: N802
        """The limit and the step are calculated once. The variable passes the limit at the end (6.6.4.3)."""
        place, type_ = self.place(statement.control, assigned=True)
        limit, step = self.temporary(), self.temporary()
        self.assign(place, type_, statement.from_, depth)
        self.line(depth, f"{limit} = {self.converted(*self.expression(statement.to), type_)}")
        code = "1" if statement.step is None else self.converted(*self.expression(statement.step), type_)
        self.line(depth, f"{step} = {code}")
        self.loop(f"({place} <= {limit} if {step} > 0 else {place} >= {limit})", statement.statements, depth)
        self.line(depth + 1, f"{place} = as_{type_.name}({place} + {step})")

    def on_WhileStatement(self, statement, depth):  # noqa: N802
        self.loop(self.condition(statement.expression), statement.statements, depth)

    def loop(self, condition, body, depth):
        count = self.temporary()
        self.line(depth, f"{count} = 0")
        self.line(depth, f"while {condition}:")
        self.line(depth + 1, f"{count} += 1")
        self.line(depth + 1, f"if {count} > {MAX_REPEATS}: raise PlcError('a loop does not end')")
        self.statements(body, depth + 1)

    def on_ExitStatement(self, statement, depth):  # noqa: N802
        self.line(depth, "break")

    def on_FunctionCallStatement(self, statement, depth):  # noqa: N802
        place, type_ = self.place(statement.name)
        if not isinstance(type_, BlockType):
            raise PlcError(f"{statement.name} is not a function block")
        outputs = []
        for parameter in statement.parameters:
            name = str(parameter.name).upper()
            if isinstance(parameter, tree.OutputParameterAssignment) and name in type_.readable:
                outputs.append((parameter.value, f"{place}.{name}", type_.readable[name]))
            elif isinstance(parameter, tree.InputParameterAssignment) and name in type_.inputs:
                self.assign(f"{place}.{name}", type_.inputs[name], parameter.value, depth)
            else:
                raise PlcError(f"{type_.name} has no {parameter}")
        self.line(depth, f"{place}.cycle(now_ms)")
        for variable, output, given in outputs:
            target, wanted = self.place(variable, assigned=True)
            self.line(depth, f"{target} = {self.converted(output, given, wanted)}")


def _element(at, first, last):
    if not first <= at <= last:
        raise PlcError(f"index {at} is outside {first} to {last}")
    return at - first
