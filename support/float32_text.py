"""Text of a number that a bus transmits as a 32-bit floating-point number."""

from __future__ import annotations

from ctypes import c_float


def float32_text(value: float) -> str:
    """Return the shortest text that is the same 32-bit number, for example "5.1" for 5.0999999."""
    same = c_float(value).value
    texts = (f"{value:.{digits}g}" for digits in (6, 7, 8))
    return next((text for text in texts if c_float(float(text)).value == same), f"{value:.9g}")
