"""pymodbus's own clients: with_pymodbus.py sync or async, tcp PORT or rtu DEVICE."""

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


class Refused(Exception):
    """The instrument answered with an exception, whose code this holds."""


def made(kind, wire, where):
    client = CLIENTS[kind, wire]
    if wire == "tcp":
        return client("127.0.0.1", port=int(where), timeout=5, retries=0)
    return client(where, baudrate=19200, parity="N", stopbits=2, timeout=5, retries=0)


class Requests:
    """What the lines ask for, by name."""

    def __init__(self, client):
        self._client = client

    async def _asked(self, name, *arguments, **named):
        answer = getattr(self._client, name)(*arguments, **named)
        if inspect.isawaitable(answer):
            answer = await answer
        if answer.isError():
            raise Refused(answer.exception_code)
        return answer

    async def words(self, function, address, count):
        name = {3: "read_holding_registers", 4: "read_input_registers"}[function]
        return (await self._asked(name, address, count=count)).registers

    async def bits(self, function, address, count):
        name = {1: "read_coils", 2: "read_discrete_inputs"}[function]
        return [int(bit) for bit in (await self._asked(name, address, count=count)).bits[:count]]

    async def float(self, address, order):
        words = await self.words(3, address, 2)
        float32 = self._client.DATATYPE.FLOAT32
        return [self._client.convert_from_registers(words, float32, word_order=ORDERS[order])]

    async def put_float(self, address, value, order):
        float32 = self._client.DATATYPE.FLOAT32
        words = self._client.convert_to_registers(float(value), float32, word_order=ORDERS[order])
        await self._asked("write_registers", address, words)

    async def word(self, address, value):
        await self._asked("write_register", address, value)

    async def put(self, address, *values):
        await self._asked("write_registers", address, list(values))

    async def coil(self, address, value):
        await self._asked("write_coil", address, bool(value))

    async def coils(self, address, *values):
        await self._asked("write_coils", address, [bool(value) for value in values])

    async def mask(self, address, keep, put):
        await self._asked("mask_write_register", address=address, and_mask=keep, or_mask=put)

    async def exchange(self, read_at, count, write_at, value):
        where = {"read_address": read_at, "read_count": count, "write_address": write_at}
        return (await self._asked("readwrite_registers", **where, values=[value])).registers

    async def server_id(self):
        await self._asked("report_device_id")

    async def identity(self, code, first):
        answer = await self._asked("read_device_information", read_code=code, object_id=first)
        return [[str(number), text.decode()] for number, text in answer.information.items()]

    async def echo(self, value):
        answer = await self._asked("diag_query_data", value.to_bytes(2, "big"))
        return list(answer.message) if isinstance(answer.message, bytes) else [answer.message]

    async def together(self, count):
        ended = []

        async def read(which):
            ended.append([which, *await self.words(3, 3840 + which % 5, 1)])

        await asyncio.gather(*map(read, range(count)))
        return ended


async def carried_out(requests, line):
    name, *words = line.split()
    try:
        return await getattr(requests, name)(*(int(w) if w.isdigit() else w for w in words)) or []
    except Refused as refused:
        return ["exception", *refused.args]
    except Exception as error:  # whoever asked is told
        return ["error", repr(error)]


async def main():
    client = made(*sys.argv[1:])
    connected = client.connect()
    if inspect.isawaitable(connected):
        await connected
    requests = Requests(client)
    while line := await asyncio.to_thread(sys.stdin.readline):
        print(json.dumps(await carried_out(requests, line)), flush=True)
    client.close()


if __name__ == "__main__":
    asyncio.run(main())
