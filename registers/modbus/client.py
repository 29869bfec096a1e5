"""A PLC's view of the instrument. The only file that knows pymodbus."""

from __future__ import annotations

import logging
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any

from registers.field import plain_unit
from registers.map import BY_NAME, REGISTERS, Register
from registers.modbus.bank import MODE, Bank
from registers.modbus.codes import Code
from registers.modbus.line_port import PARITIES, opened, possible_parity
from registers.views.facts import ascii_text, span_text

if TYPE_CHECKING:
    from pymodbus.client.base import ModbusBaseSyncClient
    from pymodbus.pdu import ModbusPDU

#: Ranges that hold every value that changes.
_READ = (range(36), range(64, 74), range(512, 546))
_SELDOM = (range(768, 784), range(3840, 3845))
_TEST = BY_NAME["test_float"]
_REFUSAL = BY_NAME["refusal"]
_NAMES = {code.value: code.name.lower().replace("_", " ") for code in Code}

#: What pymodbus would print to a terminal is told by PlcError.
logging.getLogger("pymodbus").addHandler(logging.NullHandler())


class PlcError(OSError):
    """The instrument cannot be reached, or it refused a request."""


class PortError(PlcError):
    """A serial port cannot be opened."""


class Plc:
    """One Modbus connection to an instrument; blocks while it waits for an answer."""

    def __init__(self, client: ModbusBaseSyncClient, unit: int) -> None:
        self._client = client
        self._unit = unit
        self._bank = Bank()

    @classmethod
    def connect(cls, host: str = "127.0.0.1", port: int = 5020, *, unit: int = 1, wait_s: float = 2.0) -> Plc:
        """A TCP connection, its word order settled by the test pattern.

        Raises PlcError where nobody answers, or somebody who is not a pneuforce instrument.
        """
        from pymodbus.client import ModbusTcpClient  # 70 ms, and only clients need it

        client = ModbusTcpClient(host, port=port, timeout=wait_s, retries=0)
        return cls._met(client, unit, f"no Modbus TCP server answers at {host}:{port}")

    @classmethod
    def on_line(
        cls, device: str, *, baud: int = 19200, parity: str = "even", unit: int = 1, wait_s: float = 2.0
    ) -> Plc:
        """The same on a serial port, as Modbus RTU; `parity` is even, odd or none (with two stop bits).

        Raises PortError where the port cannot be had.
        """
        from pymodbus.client import ModbusSerialClient

        stop_bits = 2 if parity == "none" else 1
        client = ModbusSerialClient(
            device,
            baudrate=baud,
            parity=PARITIES[possible_parity(device, parity)],
            stopbits=stop_bits,
            timeout=wait_s,
            retries=0,
        )
        if not client.connect():
            _say_why(device, baud, parity, stop_bits)
        return cls._met(client, unit, f"{device} cannot be opened")

    @classmethod
    def _met(cls, client: ModbusBaseSyncClient, unit: int, otherwise: str) -> Plc:
        if not client.connect():
            raise PlcError(otherwise)
        plc = cls(client, unit)
        try:
            plc._settle_word_order()
        except PlcError:
            plc.close()
            raise
        return plc

    def close(self) -> None:
        """End the connection."""
        self._client.close()  # type: ignore[no-untyped-call]

    def __enter__(self) -> Plc:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def read(self) -> dict[str, Any]:
        """Value of every register that changes, by name: in the quantity's unit; NaN is not available.

        Three requests, so three instants; within one range all values belong together. Left out is what
        repeats another value in the unit of its name (force_mn, pressure_pa, …). Raises PlcError.
        """
        return {name: value for range_ in _READ for name, value in self._values(range_).items()}

    def read_all(self) -> dict[str, Any]:
        """Value of every register by name: with those that change seldom or never. Raises PlcError."""
        return {name: value for range_ in (*_READ, *_SELDOM) for name, value in self._values(range_).items()}

    def write(self, name: str, value: object) -> None:
        """Write one register by name: a number in the quantity's unit, or the name of a code.

        Raises PlcError with what is allowed, or the exception's name, and the refusal's where the instrument
        gives one.
        """
        register = _writable(name)
        try:
            words = self._bank.words(register, register.encode(value))
        except (LookupError, TypeError, ValueError, OverflowError):
            raise PlcError(f"{name} = {value} cannot be put on the wire{_allowed(register)}") from None
        numbers = [int.from_bytes(words[at : at + 2], "big") for at in range(0, len(words), 2)]
        answer = self._ask(self._client.write_registers, register.address, values=numbers)
        if answer.isError():
            allowed = _allowed(register) if answer.exception_code == Code.ILLEGAL_VALUE else ""
            raise PlcError(f"{name} = {value} was refused: {self._why(answer)}{allowed}")

    def vent(self) -> None:
        """Open the vent. Raises PlcError where the instrument cannot be reached."""
        self.write(MODE.name, "vent")

    def _settle_word_order(self) -> None:
        words = self._words(range(_TEST.address, _TEST.end))
        for word_swap in (False, True):
            self._bank = Bank(word_swap=word_swap)
            if words == self._bank.words(_TEST, _TEST.constant or 0.0):
                return
        raise PlcError("the Modbus server that answers is no pneuforce instrument: its test pattern differs")

    def _values(self, range_: range) -> dict[str, Any]:
        registers = [r for r in REGISTERS if r.address in range_]
        codes = self._bank.codes(registers, range_.start, self._words(range_))
        read = zip(registers, codes, strict=True)
        return {r.name: r.decode(code) for r, code in read if not _named_otherwise(r)}

    def _words(self, range_: range) -> bytes:
        answer = self._ask(self._client.read_input_registers, range_.start, count=len(range_))
        if answer.isError() or len(answer.registers) != len(range_):
            raise PlcError(f"registers {range_.start}–{range_.stop - 1} were refused: {self._why(answer)}")
        return b"".join(word.to_bytes(2, "big") for word in answer.registers)

    def _ask(self, function: Any, address: int, **arguments: Any) -> ModbusPDU:
        from pymodbus.exceptions import ModbusException

        try:
            answer: ModbusPDU = function(address, device_id=self._unit, **arguments)
        except (ModbusException, OSError) as error:
            raise PlcError("the Modbus server does not answer, or has closed the connection") from error
        return answer

    def _why(self, answer: ModbusPDU) -> str:
        code = getattr(answer, "exception_code", 0)
        name = _NAMES.get(code, "an answer out of place")
        if code != Code.DEVICE_BUSY:
            return f"{name} ({code:02X}h)"
        reason = self._values(range(_REFUSAL.address, _REFUSAL.end))[_REFUSAL.name]
        return f"{name} ({code:02X}h), reason {reason}"


def _say_why(device: str, baud: int, parity: str, stop_bits: int) -> None:
    """Raises PortError with what pymodbus keeps to itself."""
    try:
        opened(device, baud, parity, stop_bits).close()
    except OSError as error:
        raise PortError(str(error)) from None


def _named_otherwise(register: Register) -> bool:
    """Whether its name ends in a unit that is not the quantity's: pressure_pa would be a number of kPa."""
    unit = ascii_text(register.unit)
    return unit != plain_unit(register.unit) and register.name.endswith(f"_{unit.lower()}")


def _writable(name: str) -> Register:
    """The register of this name. Raises PlcError."""
    if name not in BY_NAME:
        near = get_close_matches(name, [register.name for register in REGISTERS if register.writable])
        told = f"; near: {', '.join(near)}" if near else ""
        raise PlcError(f"there is no register {name}{told}")
    if _named_otherwise(BY_NAME[name]):
        raise PlcError(f"{name} repeats a value that goes by its quantity: write {name.rpartition('_')[0]}")
    if not BY_NAME[name].writable:
        raise PlcError(f"{name} is read only")
    return BY_NAME[name]


def _allowed(register: Register) -> str:
    if register.values:
        return f"; allowed: {', '.join(register.values.codes)}"
    unit = plain_unit(register.unit)
    span = span_text(register.on_wire(register.wire, unit))
    return f"; allowed: {span} {unit}".rstrip() if span else ""
