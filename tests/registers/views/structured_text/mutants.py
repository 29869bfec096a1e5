"""Mutation test: `python -m tests.registers.views.structured_text.mutants [COUNT] [SEED]`.

Each mutant is the library of function blocks with one small error. The tests must detect it. The command
prints each mutant that they do not detect.
"""

import argparse
import dataclasses
import os
import random
import subprocess
import sys
from copy import deepcopy

from blark import transform as tree

from tests.registers.views.structured_text.parsing import declarations
from tests.registers.views.structured_text.sources import LIBRARY, PROGRAM

#: Environment variable with the number of the mutant that the tests run.
VARIABLE = "STRUCTURED_TEXT_MUTANT"
TESTS = [
    f"tests/registers/views/structured_text/test_{name}.py"
    for name in ("reading", "pressure", "program", "diagnostics", "settings")
]
#: Replaced operators.
OPERATORS = {
    "=": "<>",
    "<>": "=",
    "<": "<=",
    "<=": "<",
    ">": ">=",
    ">=": ">",
    "AND": "OR",
    "OR": "AND",
    "+": "-",
    "-": "+",
    "*": "/",
    "/": "*",
}


def nodes(part):
    """Yield each node of a syntax tree, in the order of the text."""
    if dataclasses.is_dataclass(part):
        yield part
        for field in dataclasses.fields(part):
            if field.name != "meta":
                yield from nodes(getattr(part, field.name))
    elif isinstance(part, list | tuple):
        for item in part:
            yield from nodes(item)


def errors(node):
    """Yield the name and the function of each small error that a node can have."""
    if isinstance(node, tree.BinaryOperation) and str(node.op).upper() in OPERATORS:
        other = OPERATORS[str(node.op).upper()]
        yield f"{other} instead of {node.op}", lambda: setattr(node, "op", other)
    elif isinstance(node, tree.UnaryOperation) and str(node.op).upper() == "NOT":
        yield "without NOT", lambda: setattr(node, "expr", tree.UnaryOperation(op="NOT", expr=node.expr))
    elif isinstance(node, tree.Boolean):
        other = "FALSE" if str(node.value).upper() == "TRUE" else "TRUE"
        yield f"{other} instead of {node}", lambda: setattr(node, "value", other)
    elif isinstance(node, tree.BitString):
        other = format(int(str(node.value), node.base) + 1, "X" if node.base == 16 else "d")
        yield f"{node} + 1", lambda: setattr(node, "value", other)
    elif isinstance(node, tree.Integer):
        yield f"{node} + 1", lambda: setattr(node, "value", str(int(str(node.value)) + 1))
    elif isinstance(node, tree.StatementList):
        for at, statement in enumerate(node.statements):
            yield f"without {str(statement).splitlines()[0]}", lambda at=at: node.statements.pop(at)


def mutants(library):
    """Yield the description and the function of each small error that a library can have."""
    for declaration in library:
        body = getattr(declaration, "body", None)
        for node in nodes(body):
            for name, make in errors(node):
                yield f"{declaration.name}: {name} in: {' '.join(str(node).split())[:70]}", make


def mutated(library):
    """Return the library, with the error that the environment names, if it names one."""
    number = os.environ.get(VARIABLE)
    if number is None:
        return library
    library = deepcopy(library)
    _, make = list(mutants(library))[int(number)]
    make()
    return library


#: Mutants that behave as the library does, with the reason.
EQUIVALENT = {
    "PF_Decode: without WHILE Exponent <= -16": "the second loop gives the same result, but more slowly",
}


def is_detected(number):
    """Run the tests on one mutant. Return True if a test fails."""
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *TESTS],
        env=os.environ | {VARIABLE: str(number)},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode not in (0, 1):
        raise SystemExit(done.stdout + done.stderr)
    return done.returncode == 1


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("count", type=int, nargs="?", default=60)
    parser.add_argument("seed", type=int, nargs="?", default=1)
    given = parser.parse_args(arguments)
    names = [name for name, _ in mutants(declarations(LIBRARY + PROGRAM))]
    chosen = random.Random(given.seed).sample(range(len(names)), min(given.count, len(names)))
    detected = explained = 0
    for number in chosen:
        found = is_detected(number)
        detected += found
        reason = next((EQUIVALENT[name] for name in EQUIVALENT if names[number].startswith(name)), "")
        explained += bool(reason and not found)
        if not found:
            print(f"not detected: {number}: {names[number]}: {reason or 'no reason'}", flush=True)
    print(f"{detected} of {len(chosen)} mutants detected, {explained} equivalent ({len(names)} possible)")
    return detected + explained == len(chosen)


if __name__ == "__main__":
    sys.exit(not main())
