"""Clients of pymodbus: with_pymodbus.py (sync | async) (tcp PORT | rtu DEVICE)."""

import asyncio
import inspect
import json
import sys

from pymodbus.client import (
    AsyncModbusSerialClient,
    AsyncModbusTcpClient,
    ModbusSerialClient,
    ModbusTcpClient,
)

CLIENTS = {
    ("sync", "tcp"): ModbusTcpClient,
    ("sync", "rtu"): ModbusSerialClient,
    ("async", "tcp"): AsyncModbusTcpClient,
    ("async", "rtu"): AsyncModbusSerialClient,
}
ORDERS = {"ABCD": "big", "CDAB": "little"}


class ModbusExceptionAnswer(Exception):
    """Exception answer of the instrument, with the exception code as argument."""


def create_client(kind, transport, target):
    client = CLIENTS[kind, transport]
    if transport == "tcp":
        return client("127.0.0.1", port=int(target), timeout=5, retries=0)
    return client(target, baudrate=19200, parity="N", stopbits=2, timeout=5, retries=0)


class Requests:
    """Requests of pymodbus, selected by the first word of each input line."""

    def __init__(self, client):
        self._client = client

    async def _call(self, name, *arguments, **named):
        answer = getattr(self._client, name)(*arguments, **named)
        if inspect.isawaitable(answer):
            answer = await answer
        if answer.isError():
            raise ModbusExceptionAnswer(answer.exception_code)
        return answer

    async def words(self, function, address, count):
        name = {3: "read_holding_registers", 4: "read_input_registers"}[function]
        return (await self._call(name, address, count=count)).registers

    async def bits(self, function, address, count):
        name = {1: "read_coils", 2: "read_discrete_inputs"}[function]
        return [int(bit) for bit in (await self._call(name, address, count=count)).bits[:count]]

    async def float(self, address, order):
        words = await self.words(3, address, 2)
        float32 = self._client.DATATYPE.FLOAT32
        return [self._client.convert_from_registers(words, float32, word_order=ORDERS[order])]

    async def float_write(self, address, value, order):
        float32 = self._client.DATATYPE.FLOAT32
        words = self._client.convert_to_registers(float(value), float32, word_order=ORDERS[order])
        await self._call("write_registers", address, words)

    async def word_write(self, address, value):
        await self._call("write_register", address, value)

    async def words_write(self, address, *values):
        await self._call("write_registers", address, list(values))

    async def coil_write(self, address, value):
        await self._call("write_coil", address, bool(value))

    async def coils_write(self, address, *values):
        await self._call("write_coils", address, [bool(value) for value in values])

    async def mask(self, address, and_mask, or_mask):
        await self._call("mask_write_register", address=address, and_mask=and_mask, or_mask=or_mask)

    async def exchange(self, read_at, count, write_at, value):
        addresses = {"read_address": read_at, "read_count": count, "write_address": write_at}
        return (await self._call("readwrite_registers", **addresses, values=[value])).registers

    async def server_id(self):
        await self._call("report_device_id")

    async def identity(self, code, first):
        answer = await self._call("read_device_information", read_code=code, object_id=first)
        return [[str(number), text.decode()] for number, text in answer.information.items()]

    async def echo(self, value):
        answer = await self._call("diag_query_data", value.to_bytes(2, "big"))
        return list(answer.message) if isinstance(answer.message, bytes) else [answer.message]

    async def together(self, count):
        answers = []

        async def read(number):
            answers.append([number, *await self.words(3, 3840 + number % 5, 1)])

        await asyncio.gather(*map(read, range(count)))
        return answers


async def carry_out(requests, line):
    name, *words = line.split()
    try:
        return await getattr(requests, name)(*(int(w) if w.isdigit() else w for w in words)) or []
    except ModbusExceptionAnswer as error:
        return ["exception", *error.args]
    except Exception as error:  # the message is passed to the test
        return ["error", repr(error)]


async def main():
    client = create_client(*sys.argv[1:])
    connected = client.connect()
    if inspect.isawaitable(connected):
        await connected
    requests = Requests(client)
    while line := await asyncio.to_thread(sys.stdin.readline):
        print(json.dumps(await carry_out(requests, line)), flush=True)
    client.close()


if __name__ == "__main__":
    asyncio.run(main())
