"""Server of modbus_tk with 200 registers or bits of each kind: `python stock_modbus_tk.py PORT`."""

import signal
import sys

from modbus_tk import defines, modbus_tcp

SIZE = 200
server = modbus_tcp.TcpServer(port=int(sys.argv[1]), address="127.0.0.1")
server.start()
slave = server.add_slave(1)
for kind in (defines.COILS, defines.DISCRETE_INPUTS, defines.HOLDING_REGISTERS, defines.ANALOG_INPUTS):
    slave.add_block(str(kind), kind, 0, SIZE)
signal.pause()
