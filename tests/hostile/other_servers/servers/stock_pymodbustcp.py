"""Server of pyModbusTCP with 200 registers or bits of each kind: `python stock_pymodbustcp.py PORT`."""

import sys

from pyModbusTCP.server import DataBank, DeviceIdentification, ModbusServer

SIZE = 200
bank = DataBank(coils_size=SIZE, d_inputs_size=SIZE, h_regs_size=SIZE, i_regs_size=SIZE)
identity = DeviceIdentification(vendor_name=b"vendor", product_code=b"product", major_minor_revision=b"1.0")
ModbusServer("127.0.0.1", int(sys.argv[1]), data_bank=bank, device_id=identity).start()
