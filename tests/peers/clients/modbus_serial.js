// Client with modbus-serial of npm: node modbus_serial.js tcp PORT, or rtu DEVICE
const ModbusRTU = require("modbus-serial");
const { carryOut, toFloat, fromFloat, together } = require("./lines.js");

const [transport, target] = process.argv.slice(2);
const bus = new ModbusRTU();

const requests = {
  words: async (code, address, count) =>
    (await (code === 3 ? bus.readHoldingRegisters(address, count) : bus.readInputRegisters(address, count))).data,
  bits: async (code, address, count) =>
    (await (code === 1 ? bus.readCoils(address, count) : bus.readDiscreteInputs(address, count))).data
      .slice(0, count)
      .map(Number),
  float: async (address, order) => [toFloat((await bus.readHoldingRegisters(address, 2)).buffer, order)],
  float_write: async (address, value, order) => void (await bus.writeRegisters(address, fromFloat(value, order))),
  word_write: async (address, value) => void (await bus.writeRegister(address, value)),
  words_write: async (address, ...values) => void (await bus.writeRegisters(address, values)),
  coil_write: async (address, value) => void (await bus.writeCoil(address, Boolean(value))),
  coils_write: async (address, ...values) => void (await bus.writeCoils(address, values.map(Boolean))),
  mask: async (address, and, or) => void (await bus.maskWriteRegister(address, and, or)),
  exchange: async (read, count, write, value) => (await bus.readWriteRegisters(read, count, write, 1, [value])).data,
  // The function needs two unused numbers before its callback; without them, the callback is never called.
  server_id: async () => [(await bus.reportServerID(0, 0)).serverId],
  identity: async (code, object) => Object.entries((await bus.readDeviceIdentification(code, object)).data),
  together: (count) => together(count, async (address) => (await bus.readHoldingRegisters(address, 1)).data[0]),
};

const connected =
  transport === "tcp"
    ? bus.connectTCP("127.0.0.1", { port: Number(target) })
    : bus.connectRTUBuffered(target, { baudRate: 19200, parity: "none", stopBits: 2 });
connected
  .then(() => {
    bus.setID(1);
    bus.setTimeout(5000);
    return carryOut(requests, (error) => error.modbusCode);
  })
  .then(() => bus.close(() => {}));
