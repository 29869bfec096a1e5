"""Request PDUs and answer PDUs as hex texts, without a transport."""

from pneuforce.registers.modbus.device_identification import DeviceIdentification
from pneuforce.registers.modbus.pdu import RequestHandler
from pneuforce.registers.modbus.register_bank import RegisterBank
from pneuforce.registers.source import Peer
from tests.registers.modbus.memory_source import MemorySource
from tests.registers.modbus.serving import IDENTITY

PLC = Peer("modbus_tcp", "127.0.0.1")


def request_handler(source, read_only=False):
    writable = () if read_only else None
    return RequestHandler(RegisterBank(), source, DeviceIdentification(IDENTITY), writable=writable)


def answer(request, source=None, read_only=False):
    pdu = request_handler(source or MemorySource(), read_only).answer(bytes.fromhex(request), PLC, 0.0)
    return None if pdu is None else pdu.hex(" ")


def spaced(text):
    return bytes.fromhex(text).hex(" ")
