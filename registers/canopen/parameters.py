"""Communication parameters: the defaults, the values written by SDO, and the bus load that they can cause."""

from __future__ import annotations

from collections.abc import Mapping

from pneuforce.registers.can.frames import COMMAND, EMERGENCY, FORCE, HEARTBEAT
from pneuforce.registers.can.options import MAX_BUS_LOAD, SAMPLE_RATE_HZ, CanOptions
from pneuforce.registers.can.wire import worst_case_bits
from pneuforce.registers.canopen.abort import AbortCode, SdoAbort
from pneuforce.registers.canopen.communication import (
    ERROR_FIELD,
    EVENT_DRIVEN,
    PDO_DISABLED,
    PRODUCER_HEARTBEAT,
    TPDOS,
    tpdo_index,
)
from pneuforce.registers.canopen.entry import EntryAddress
from pneuforce.registers.canopen.object_dictionary import ENTRIES

_PARAMETERS = {e.address: e for e in ENTRIES if e.default is not None and e.address != ERROR_FIELD}
_INHIBIT_TIMES = {(tpdo_index(number), 3) for number in range(len(TPDOS))}


class Parameters:
    """Values of the communication parameters by index and sub-index."""

    def __init__(self, options: CanOptions) -> None:
        self.options = options
        self._values = _default_values(options.node_id)

    def __getitem__(self, address: EntryAddress) -> int:
        return self._values[address]

    def reset(self, options: CanOptions, stored: Mapping[EntryAddress, int]) -> None:
        """Restore the stored values, and the defaults of all other parameters.

        COB-IDs in `stored` are relative to the node id. Raises ValueError and restores only defaults if a
        stored value is not allowed now.
        """
        self.options = options
        self._values = _default_values(options.node_id)
        for address, value in stored.items():
            _check(address, value, options.node_id)
        values = self._values | {
            address: _with_node_id(address, value, options.node_id) for address, value in stored.items()
        }
        if not bus_load(values, options) <= MAX_BUS_LOAD:
            raise ValueError(f"its values can load the bus by more than {MAX_BUS_LOAD:.0%}")
        self._values = values

    def to_store(self) -> Mapping[EntryAddress, int]:
        """Return the values of all parameters that can be written, with COB-IDs relative to the node id."""
        return {
            address: _with_node_id(address, value, -self.options.node_id)
            for address, value in self._values.items()
            if _PARAMETERS[address].writable
        }

    def set(self, address: EntryAddress, value: int) -> None:
        """Change one parameter.

        Raises SdoAbort if an inhibit time is changed while its PDO is enabled (CiA 301, object 1800h). Also
        raises SdoAbort if the new value allows a bus load above 60 %.
        """
        changed = self._values | {address: value}
        if address in _INHIBIT_TIMES and value != self._values[address]:
            pdo_enabled = not self._values[address[0], 1] & PDO_DISABLED
            if pdo_enabled:
                raise SdoAbort(AbortCode.INVALID_VALUE)
        if not bus_load(changed, self.options) <= MAX_BUS_LOAD:
            raise SdoAbort(AbortCode.INVALID_VALUE)
        self._values = changed


def _default_values(node_id: int) -> dict[EntryAddress, int]:
    return {
        address: _with_node_id(address, entry.default, node_id)
        for address, entry in _PARAMETERS.items()
        if entry.default is not None
    }


def _with_node_id(address: EntryAddress, value: int, node_id: int) -> int:
    return value + node_id * _PARAMETERS[address].adds_node_id


def _check(address: EntryAddress, value: int, node_id: int) -> None:
    """Raise ValueError if a stored value is not one that a master could write now."""
    entry = _PARAMETERS.get(address)
    name = f"object {address[0]:04X}h:{address[1]}"
    if entry is None or not entry.writable:
        raise ValueError(f"{name} is not a parameter that can be stored")
    try:
        raw = _with_node_id(address, value, node_id).to_bytes(entry.type.size, "little")
        entry.decode(raw, node_id)
    except (OverflowError, SdoAbort):
        raise ValueError(f"the value of {name} is not allowed") from None


def bus_load(values: Mapping[EntryAddress, int], options: CanOptions) -> float:
    """Return the worst-case bus load of the node, 0 to 1, without the frames that answer SYNC and SDO."""
    rates_hz = [(tpdo[0], _tpdo_rate_hz(values, number, options)) for number, tpdo in enumerate(TPDOS)]
    rates_hz += [
        (HEARTBEAT, _rate_hz(values[PRODUCER_HEARTBEAT] / 1e3)),
        (COMMAND, COMMAND.max_rate_hz),
        (EMERGENCY, EMERGENCY.max_rate_hz),
    ]
    return sum(hz * worst_case_bits(frame.length) for frame, hz in rates_hz) / options.bit_rate


def _tpdo_rate_hz(values: Mapping[EntryAddress, int], number: int, options: CanOptions) -> float:
    """Return the highest rate of an event-driven TPDO; 0 for a disabled or a synchronous TPDO.

    `max_rate_hz` of the frame is calculated with the default event timer and inhibit time.
    """
    frame, default_inhibit, default_timer_ms = TPDOS[number]
    index = tpdo_index(number)
    if values[index, 1] & PDO_DISABLED or values[index, 2] not in EVENT_DRIVEN:
        return 0.0
    inhibit = values[index, 3]
    # With a shorter inhibit time, a frame whose content changes with each sample is sent with each sample.
    events_hz = frame.max_rate_hz if inhibit >= default_inhibit else SAMPLE_RATE_HZ
    events_hz = options.max_force_rate_hz if frame is FORCE else events_hz
    timer_hz = max(0.0, _rate_hz(values[index, 5] / 1e3) - _rate_hz(default_timer_ms / 1e3))
    return min(events_hz + timer_hz, _rate_hz(inhibit / 1e4)) if inhibit else events_hz + timer_hz


def _rate_hz(period_s: float) -> float:
    return 1 / period_s if period_s else 0.0
