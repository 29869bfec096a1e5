"""Prepared test objects: the common begin of many tests is computed once, and each test gets a copy."""

from copy import deepcopy
from functools import wraps


def prepared_once(make):
    """Decorate a function that returns a new object. It runs once for equal arguments; callers get copies.

    The arguments are compared, because some of them are dictionaries and have no hash.
    """
    made = []

    @wraps(make)
    def copy_of(*arguments, **options):
        known = [original for key, original in made if key == (arguments, options)]
        if not known:
            known = [make(*arguments, **options)]
            made.append((deepcopy((arguments, options)), *known))
        return deepcopy(known[0])

    return copy_of
