"""Standard function blocks of IEC 61131-3 in virtual time: TON, R_TRIG and F_TRIG."""


class OnDelay:
    """TON: Q becomes TRUE when IN has been TRUE for PT (IEC 61131-3:2013, table 46 and figure 15)."""

    TYPES = {"IN": "BOOL", "PT": "TIME", "Q": "BOOL", "ET": "TIME"}  # noqa: RUF012

    def __init__(self):
        self.IN, self.PT, self.Q, self.ET = False, 0, False, 0
        self._start_ms = None

    def cycle(self, now_ms):
        if not self.IN:
            self._start_ms = None
        elif self._start_ms is None:
            self._start_ms = now_ms
        self.ET = 0 if self._start_ms is None else min(now_ms - self._start_ms, self.PT)
        self.Q = self.IN and self.ET >= self.PT


class RisingEdge:
    """R_TRIG: Q is TRUE for the one cycle in which CLK becomes TRUE."""

    TYPES = {"CLK": "BOOL", "Q": "BOOL"}  # noqa: RUF012

    def __init__(self):
        self.CLK, self.Q, self._before = False, False, False

    def cycle(self, now_ms):
        self.Q = self.CLK and not self._before
        self._before = self.CLK


class FallingEdge:
    """F_TRIG: Q is TRUE for the one cycle in which CLK becomes FALSE."""

    TYPES = {"CLK": "BOOL", "Q": "BOOL"}  # noqa: RUF012

    def __init__(self):
        self.CLK, self.Q, self._before = False, False, False

    def cycle(self, now_ms):
        self.Q = self._before and not self.CLK
        self._before = self.CLK


STANDARD_BLOCKS = {"TON": OnDelay, "R_TRIG": RisingEdge, "F_TRIG": FallingEdge}
