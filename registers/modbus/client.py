"""Modbus client for the instrument that addresses registers by name. Only this file imports pymodbus."""

from __future__ import annotations

import inspect
import logging
import time
from typing import TYPE_CHECKING, Any

from pneuforce.registers.map import BY_NAME, COMMAND_KEY, REGISTERS
from pneuforce.registers.modbus.client_context import handshake_problem
from pneuforce.registers.modbus.client_errors import (
    ModbusClientError,
    NoAnswerError,
    SerialPortError,
    UnknownHostError,
    WriteRejectedError,
)
from pneuforce.registers.modbus.client_registers import allowed_values, repeats_quantity, writable_register
from pneuforce.registers.modbus.exception_codes import ExceptionCode
from pneuforce.registers.modbus.register_bank import MODE, RegisterBank
from pneuforce.support.fair_lock import FairLock
from pneuforce.support.host_address import address_problem

if TYPE_CHECKING:
    import ssl

    from pymodbus.client.base import ModbusBaseSyncClient
    from pymodbus.pdu import ModbusPDU

__all__ = ["ModbusClient", "ModbusClientError", "NoAnswerError", "SerialPortError", "WriteRejectedError"]

#: Ranges of the registers that change.
_CHANGING_RANGES = (range(51), range(64, 75), range(512, 558))
#: Ranges of the registers that change seldom or never.
_CONSTANT_RANGES = (range(768, 800), range(3840, 3845))
#: Registers with the answer to a command.
_ANSWER = range(524, 527)
_COMMAND_POLL_S = 0.02
_TEST = BY_NAME["test_float"]
_REJECT_REASON = BY_NAME["reject_reason"]
_EXCEPTION_NAMES = {code.value: code.name.lower().replace("_", " ") for code in ExceptionCode}

# ModbusClientError reports these errors, so pymodbus must not print them as well.
logging.getLogger("pymodbus").addHandler(logging.NullHandler())


class ModbusClient:
    """Client with one Modbus connection to an instrument. Every call blocks until the answer arrives.

    Several threads may use a client. Their requests are sent one after the other, in the order of the calls.
    """

    def __init__(self, client: ModbusBaseSyncClient, unit: int) -> None:
        self._client = client
        self._unit = {_unit_argument(client): unit}
        self._bank = RegisterBank()
        self._lock = FairLock()
        self._closed = False

    @classmethod
    def connect(
        cls, host: str = "127.0.0.1", port: int = 5020, *, unit: int = 1, wait_s: float = 2.0
    ) -> ModbusClient:
        """Connect over TCP, and determine the word order with the test pattern.

        Raises ModbusClientError if no server answers, or if the server is not a pneuforce instrument.
        """
        from pymodbus.client import ModbusTcpClient  # this import takes 70 ms, and only clients need it

        client = ModbusTcpClient(host, port=port, timeout=wait_s, retries=0)
        return cls._connect(client, unit, f"no Modbus TCP server answers at {host}:{port}", host)

    @classmethod
    def connect_tls(
        cls, host: str, port: int, context: ssl.SSLContext, *, unit: int = 1, wait_s: float = 2.0
    ) -> ModbusClient:
        """Connect with Modbus/TCP Security. The context contains the certificates; see `client_context`.

        Raises ModbusClientError as `connect`, or if one side does not accept the certificate of the other.
        """
        from pymodbus.client import ModbusTlsClient

        client = ModbusTlsClient(host, port=port, sslctx=context, timeout=wait_s, retries=0)
        try:
            return cls._connect(client, unit, f"no Modbus/TCP Security at {host}:{port}", host)
        except UnknownHostError:
            raise
        except NoAnswerError as error:
            problem = handshake_problem(host, port, context, wait_s)
            hint = "possibly the instrument does not accept this certificate: its log names the reason"
            raise NoAnswerError(f"{error}: {problem or hint}") from None

    @classmethod
    def connect_serial(
        cls, device: str, *, baud: int = 19200, parity: str = "even", unit: int = 1, wait_s: float = 2.0
    ) -> ModbusClient:
        """Connect over a serial port with Modbus RTU, and determine the word order with the test pattern.

        `parity` is "even", "odd", or "none" with two stop bits. Raises SerialPortError if the port cannot be
        opened, otherwise ModbusClientError as in `connect`.
        """
        from pymodbus.client import ModbusSerialClient

        # rtu_port needs termios, which Windows lacks. Clients over TCP also work on Windows.
        from pneuforce.registers.modbus.rtu_port import PARITIES, supported_parity

        stop_bits = 2 if parity == "none" else 1
        client = ModbusSerialClient(
            device,
            baudrate=baud,
            parity=PARITIES[supported_parity(device, parity)],
            stopbits=stop_bits,
            timeout=wait_s,
            retries=0,
        )
        if not client.connect():
            _raise_port_error(device, baud, parity, stop_bits)
        return cls._connect(client, unit, f"{device} cannot be opened")

    @classmethod
    def _connect(
        cls, client: ModbusBaseSyncClient, unit: int, error_message: str, host: str = ""
    ) -> ModbusClient:
        if not client.connect():
            if host and (problem := address_problem(host)):
                raise UnknownHostError(problem)
            raise NoAnswerError(error_message)
        connected = cls(client, unit)
        try:
            connected._determine_word_order()
        except ModbusClientError:
            connected.close()
            raise
        return connected

    def close(self) -> None:
        """Close the connection."""
        with self._lock:
            self._closed = True
            self._client.close()  # type: ignore[no-untyped-call]

    def __enter__(self) -> ModbusClient:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def read(self) -> dict[str, Any]:
        """Return the values of all registers that change, by register name.

        Numbers are in the quantity's unit; NaN means not available. The values come from three requests: the
        values of one address range belong to the same instant. Registers that repeat a value in another unit
        (force_mn, pressure_pa, …) are left out. Raises ModbusClientError.
        """
        return {
            name: value for range_ in _CHANGING_RANGES for name, value in self._read_values(range_).items()
        }

    def read_all(self) -> dict[str, Any]:
        """Return the values of all registers, by register name.

        `read` returns the same values without the registers that change seldom or never. Raises
        ModbusClientError.
        """
        ranges = (*_CHANGING_RANGES, *_CONSTANT_RANGES)
        return {name: value for range_ in ranges for name, value in self._read_values(range_).items()}

    def write(self, name: str, value: object) -> None:
        """Write one register by name. `value` is a number in the quantity's unit, or the name of a code.

        Raises ModbusClientError if the value is invalid or the write is rejected. The message contains the
        allowed values, or the name of the Modbus exception and the reject reason.
        """
        register = writable_register(name)
        try:
            if isinstance(value, bool) or (isinstance(value, str) and not (register.values or register.bits)):
                raise TypeError  # Python would take them as numbers
            words = self._bank.encode_words(register, register.encode(value))
        except (LookupError, TypeError, ValueError, OverflowError):
            raise ModbusClientError(f"{name} = {value}: invalid value{allowed_values(register)}") from None
        numbers = [int.from_bytes(words[at : at + 2], "big") for at in range(0, len(words), 2)]
        with self._lock:  # the reject reason is that of the last write
            answer = self._request(self._client.write_registers, register.address, values=numbers)
            reason = self._reject_reason(answer) if answer.isError() else ""
        if answer.isError():
            is_illegal_value = answer.exception_code == ExceptionCode.ILLEGAL_VALUE
            allowed = allowed_values(register) if is_illegal_value else ""
            message = f"{name} = {value} was rejected: {_describe_error(answer, reason)}{allowed}"
            raise WriteRejectedError(message, reason or _exception_name(answer))

    def vent(self) -> None:
        """Open the vent. Raises ModbusClientError if the instrument cannot be reached."""
        self.write(MODE.name, "vent")

    def read_block(self, addresses: range) -> dict[str, Any]:
        """Return the values of the registers in one range of addresses, by register name, from one request.

        All values belong to the same instant. Raises ModbusClientError.
        """
        return self._read_values(addresses)

    def run_command(self, code: str, argument: int = 0, *, timeout_s: float = 2.0) -> str:
        """Run a command of registers 520–523, and return its reject reason; "none" if it is done.

        Raises WriteRejectedError if the command does not start, NoAnswerError if it does not finish within
        `timeout_s`, and ModbusClientError.
        """
        sequence = (self.read_block(_ANSWER)["answer_sequence"] + 1) % 0x10000
        self._start_command(code, argument, sequence)
        until_s = time.monotonic() + timeout_s
        while time.monotonic() < until_s:
            answer = self.read_block(_ANSWER)
            if answer["answer_sequence"] == sequence and answer["answer_state"] != "busy":
                return str(answer["answer_result"])
            time.sleep(_COMMAND_POLL_S)
        raise NoAnswerError(f"the command {code} was not finished within {timeout_s:g} s")

    def _start_command(self, code: str, argument: int, sequence: int) -> None:
        """Write the registers of a command. The error of a rejection names the command, not its registers."""
        try:
            self.write("command_key", COMMAND_KEY)
            self.write("command_code", code)
            self.write("command_argument", argument)
            self.write("command_sequence", sequence)
        except WriteRejectedError as error:
            reason = str(error).partition(" was rejected: ")[2]
            raise WriteRejectedError(f"{code} was rejected: {reason}", error.reason) from None

    def _determine_word_order(self) -> None:
        words = self._read_words(range(_TEST.address, _TEST.end))
        for word_swap in (False, True):
            self._bank = RegisterBank(word_swap=word_swap)
            if words == self._bank.encode_words(_TEST, _TEST.constant or 0.0):
                return
        raise ModbusClientError(
            f"the Modbus server is not a pneuforce instrument: registers {_TEST.address}–{_TEST.end - 1} "
            "do not contain the test pattern"
        )

    def _read_values(self, range_: range) -> dict[str, Any]:
        registers = [r for r in REGISTERS if r.address in range_]
        codes = self._bank.decode_words(registers, range_.start, self._read_words(range_))
        read = zip(registers, codes, strict=True)
        return {r.name: r.decode(code) for r, code in read if not repeats_quantity(r)}

    def _read_words(self, range_: range) -> bytes:
        answer = self._request(self._client.read_input_registers, range_.start, count=len(range_))
        if answer.isError() or len(answer.registers) != len(range_):
            raise ModbusClientError(
                f"reading registers {range_.start}–{range_.stop - 1} failed: {_describe_error(answer)}"
            )
        return b"".join(word.to_bytes(2, "big") for word in answer.registers)

    def _request(self, function: Any, address: int, **arguments: Any) -> ModbusPDU:
        from pymodbus.exceptions import ModbusException

        with self._lock:
            if self._closed:  # pymodbus would open another connection, which nothing would close
                raise NoAnswerError("the connection is closed")
            try:
                answer: ModbusPDU = function(address, **self._unit, **arguments)
            except (ModbusException, OSError) as error:
                why = "the Modbus server does not answer, or has closed the connection"
                raise NoAnswerError(why) from error
        return answer

    def _reject_reason(self, answer: ModbusPDU) -> str:
        """Return the reject reason of a rejected write; "" if the exception itself is the reason."""
        if getattr(answer, "exception_code", 0) != ExceptionCode.DEVICE_BUSY:
            return ""
        return str(self.read_block(range(_REJECT_REASON.address, _REJECT_REASON.end))[_REJECT_REASON.name])


def _unit_argument(client: ModbusBaseSyncClient) -> str:
    """Return the name of the argument for the unit: "device_id" since pymodbus 3.10, "slave" before."""
    return "slave" if "slave" in inspect.signature(client.read_input_registers).parameters else "device_id"


def _exception_name(answer: ModbusPDU) -> str:
    return _EXCEPTION_NAMES.get(getattr(answer, "exception_code", 0), "unexpected answer")


def _describe_error(answer: ModbusPDU, reason: str = "") -> str:
    description = f"{_exception_name(answer)} ({getattr(answer, 'exception_code', 0):02X}h)"
    return f"{description}, reason {reason}" if reason else description


def _raise_port_error(device: str, baud: int, parity: str, stop_bits: int) -> None:
    """Raise SerialPortError with the cause, which pymodbus does not report."""
    from pneuforce.registers.modbus.rtu_port import open_port

    try:
        open_port(device, baud, parity, stop_bits).close()
    except OSError as error:
        raise SerialPortError(str(error)) from None
