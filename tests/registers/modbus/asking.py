"""One request in hex, one answer in hex, without a wire between."""

from registers.modbus.bank import Bank
from registers.modbus.identity import Identity
from registers.modbus.pdu import Responder
from registers.source import Peer
from tests.registers.modbus.memory import MemorySource
from tests.registers.modbus.serving import IDENTITY

PLC = Peer("modbus_tcp", "127.0.0.1")


def responder(source, read_only=False):
    return Responder(Bank(), source, Identity(IDENTITY), read_only=read_only)


def answer(request, source=None, read_only=False):
    pdu = responder(source or MemorySource(), read_only).answer(bytes.fromhex(request), PLC, 0.0)
    return None if pdu is None else pdu.hex(" ")


def spaced(text):
    return bytes.fromhex(text).hex(" ")
