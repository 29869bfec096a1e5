"""Server of pymodbus with 200 registers or bits of each kind: `python stock_pymodbus.py PORT`."""

import asyncio
import sys

from pymodbus import ModbusDeviceIdentification
from pymodbus.datastore import ModbusDeviceContext, ModbusSequentialDataBlock, ModbusServerContext
from pymodbus.server import StartAsyncTcpServer

SIZE = 200
blocks = {kind: ModbusSequentialDataBlock(1, [0] * SIZE) for kind in ("di", "co", "hr", "ir")}
context = ModbusServerContext(devices=ModbusDeviceContext(**blocks), single=True)
identity = ModbusDeviceIdentification(info={0: "vendor", 1: "product", 2: "1.0"})
asyncio.run(StartAsyncTcpServer(context, identity=identity, address=("127.0.0.1", int(sys.argv[1]))))
