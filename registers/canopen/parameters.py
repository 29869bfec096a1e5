"""Parameters: what SDO has changed, the defaults else; and the bus load that they can cause."""

from __future__ import annotations

from collections.abc import Mapping

from registers.can.frames import COMMAND, EMERGENCY, FORCE, HEARTBEAT
from registers.can.options import HIGHEST_LOAD, RIG_RATE_HZ, Options
from registers.can.wire import longest_bits
from registers.canopen.abort import Abort, Why
from registers.canopen.communication import BY_EVENT, MASTER, OFF, PRODUCER, TPDOS, tpdo_at
from registers.canopen.dictionary import ENTRIES

Place = tuple[int, int]  #: index and sub-index
_DEFAULTS = {entry.at: (entry.default, entry.plus_node_id) for entry in ENTRIES if entry.default is not None}
_INHIBIT_TIMES = {(tpdo_at(number), 3) for number in range(len(TPDOS))}


class Parameters:
    """The parameters by index and sub-index."""

    def __init__(self, options: Options) -> None:
        self._options = options
        self._values = self._defaults()

    def _defaults(self) -> dict[Place, int]:
        node_id = self._options.node_id
        return {at: default + node_id * on_top for at, (default, on_top) in _DEFAULTS.items()}

    def __getitem__(self, at: Place) -> int:
        return self._values[at]

    def reset(self) -> None:
        """Back to the defaults, but for the watch over the master: no reset leaves a balloon unwatched."""
        self._values = self._defaults() | {MASTER: self._values[MASTER]}

    def set(self, at: Place, value: int) -> None:
        """Change one.

        Raises Abort: an inhibit time while its PDO is not off (CiA 301 on 1800h), or anything with which the
        node could load the bus by more than 60 %.
        """
        changed = self._values | {at: value}
        if at in _INHIBIT_TIMES and value != self._values[at] and not self._values[at[0], 1] & OFF:
            raise Abort(Why.VALUE)
        if not bus_load(changed, self._options) <= HIGHEST_LOAD:
            raise Abort(Why.VALUE)
        self._values = changed


def bus_load(values: Mapping[Place, int], options: Options) -> float:
    """Share of the bus that the node takes at worst; what the master asks for by SYNC and SDO is left out."""
    rates_hz = [(tpdo[0], _pdo_hz(values, number, options)) for number, tpdo in enumerate(TPDOS)]
    beats_hz = _hz(values[PRODUCER] / 1e3)
    rates_hz += [(HEARTBEAT, beats_hz), (COMMAND, COMMAND.most_per_s), (EMERGENCY, EMERGENCY.most_per_s)]
    return sum(hz * longest_bits(frame.length) for frame, hz in rates_hz) / options.bit_rate


def _pdo_hz(values: Mapping[Place, int], number: int, options: Options) -> float:
    """How often a TPDO may come; `most_per_s` counts with the default event timer and inhibit time."""
    frame, least, default_ms = TPDOS[number]
    index = tpdo_at(number)
    if values[index, 1] & OFF or values[index, 2] not in BY_EVENT:
        return 0.0
    inhibit = values[index, 3]
    events_hz = frame.most_per_s if inhibit >= least else RIG_RATE_HZ  # a status may flicker with each sample
    events_hz = options.most_force_hz if frame is FORCE else events_hz
    more_hz = max(0.0, _hz(values[index, 5] / 1e3) - _hz(default_ms / 1e3))
    return min(events_hz + more_hz, _hz(inhibit / 1e4)) if inhibit else events_hz + more_hz


def _hz(period_s: float) -> float:
    return 1 / period_s if period_s else 0.0
