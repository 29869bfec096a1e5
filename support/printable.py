"""Text from files and from other programs for a terminal, with escaped control characters.

A terminal executes control characters: they can change text that is already shown, or the title of the
window. Characters that change the direction of a text can give a line another meaning.
"""

from __future__ import annotations


def printable(text: str, keep: str = "") -> str:
    """Return a text in which each character that is not printable is an escape sequence of Python.

    Not printable are control and format characters, surrogates, unassigned characters, and all separators
    except the space (`str.isprintable`). The characters in `keep` stay.
    """
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() or c in keep else _escape(c) for c in text)


def printable_json(text: str) -> str:
    """Return JSON in which each character that is not printable is a JSON escape sequence.

    Line breaks stay, because JSON contains them only between its values.
    """
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() or c == "\n" else _escape_json(c) for c in text)


def _escape(character: str) -> str:
    return character.encode("unicode_escape").decode("ascii")


def _escape_json(character: str) -> str:
    units = character.encode("utf-16-be", errors="surrogatepass").hex()
    return "".join(f"\\u{units[at : at + 4]}" for at in range(0, len(units), 4))
