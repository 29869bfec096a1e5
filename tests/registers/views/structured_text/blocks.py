"""Function blocks and programs in virtual time, run by the translator or by matiec."""

from functools import cache

from tests.registers.views.structured_text.compiled import CompiledBlock
from tests.registers.views.structured_text.mutants import mutated
from tests.registers.views.structured_text.parsing import declarations
from tests.registers.views.structured_text.sources import TEXT
from tests.registers.views.structured_text.translator import translated


@cache
def translated_text(text=TEXT):
    """Return the blocks and programs of a text by their names."""
    return translated(mutated(declarations(text)))


class TranslatedBlock:
    """New instance of a function block or of a program: a mapping from names to values."""

    def __init__(self, name, text=TEXT):
        self._instance = translated_text(text)[name.upper()].create()

    def _place(self, name):
        """Return the instance or structure that contains a variable, and the name of the variable."""
        *path, member = name.upper().split(".")
        place = self._instance
        for part in path:
            place = getattr(place, part)
        return place, member

    def __getitem__(self, name):
        return getattr(*self._place(name))

    def __setitem__(self, name, value):
        place, member = self._place(name)
        setattr(place, member, type(place).TYPES[member].value(value))

    def words(self, words, array="Words"):
        self[array][: len(words)] = words

    def cycle(self, now_s=0.0, **inputs):
        for name, value in inputs.items():
            self[name] = value
        self._instance.cycle(round(1000 * now_s))
        return self


#: The ways to run the blocks. The fixture `blocks` selects one of them.
WAYS = {"translated": TranslatedBlock, "matiec": CompiledBlock}
selected = ["translated"]


def Block(name, text=TEXT):  # noqa: N802
    """Return a new instance of a block, run in the selected way."""
    return WAYS[selected[-1]](name, text)
