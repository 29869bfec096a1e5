"""Proofs of the firmware: `python -m tests.proofs [PROPERTY …]`.

Prints one line per property: the result, the time, and whether the planted error is found. Ends with code 1
if a property is not proved, or if a planted error is not found.
"""

import sys

from tests.proofs.catalogue import PROPERTIES, Property
from tests.proofs.checker import AVR, INSTALL, check, checker


def report(prop: Property) -> tuple[bool, str]:
    """Prove one property. Return True if everything is as expected, and the line to print."""
    models = ((), AVR) if prop.avr else ((),)
    proofs = [check(prop, model) for model in models]
    planted = [check(prop, model, prop.planted) for model in models]
    verdict = next((proof.verdict for proof in proofs if proof.verdict != "proved"), "proved")
    missed = next((error.verdict for error in planted if error.verdict != "violated"), "")
    found = f"NOT FOUND ({missed})" if missed else "found"
    bits = "32, 16" if prop.avr else "32"
    seconds = sum(result.seconds for result in (*proofs, *planted))
    line = f"{verdict:8} int {bits:6} {seconds:5.1f} s  planted error {found}  {prop.sentence}"
    return verdict == "proved" and not missed, line


def main(names: list[str]) -> int:
    """Prove the properties with these names, or all. Return the exit code."""
    if checker() is None:
        print(f"the model checker is not installed: {INSTALL}")
        return 1
    failed = 0
    for prop in PROPERTIES:
        if not names or prop.name in names:
            good, line = report(prop)
            failed += not good
            print(line, flush=True)
    print(f"{failed} not proved" if failed else "all proved")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
