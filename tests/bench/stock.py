"""pymodbus's own server, as its documentation has it: `python -m tests.bench.stock PORT`."""

import asyncio
import logging
import sys

from pymodbus.datastore import ModbusDeviceContext, ModbusSequentialDataBlock, ModbusServerContext
from pymodbus.server import ModbusTcpServer


async def main(port):
    block = ModbusSequentialDataBlock(1, [17] * 1000)
    context = ModbusServerContext(devices=ModbusDeviceContext(ir=block, hr=block), single=True)
    server = ModbusTcpServer(context, address=("127.0.0.1", port))
    await server.serve_forever(background=True)
    print("ready", flush=True)
    await asyncio.Event().wait()


if __name__ == "__main__":
    logging.getLogger("pymodbus").addHandler(logging.NullHandler())
    asyncio.run(main(int(sys.argv[1])))
