// Client with jsmodbus of npm: node jsmodbus.js tcp PORT, or rtu DEVICE
const net = require("net");
const modbus = require("jsmodbus");
const { carryOut, toFloat, fromFloat, together } = require("./lines.js");

const [transport, target] = process.argv.slice(2);

const openTcp = () => {
  const stream = net.connect(Number(target), "127.0.0.1");
  return [stream, new modbus.client.TCP(stream, 1), "connect"];
};
const openSerial = () => {
  const { SerialPort } = require("serialport");
  const stream = new SerialPort({ path: target, baudRate: 19200, parity: "none", stopBits: 2 });
  return [stream, new modbus.client.RTU(stream, 1), "open"];
};
const [stream, bus, openEvent] = transport === "tcp" ? openTcp() : openSerial();

const body = async (request) => (await request).response.body;
const readWords = (code, address, count) =>
  body(code === 3 ? bus.readHoldingRegisters(address, count) : bus.readInputRegisters(address, count));

const requests = {
  words: async (code, address, count) => Array.from((await readWords(code, address, count)).valuesAsArray),
  bits: async (code, address, count) =>
    Array.from(
      (await body(code === 1 ? bus.readCoils(address, count) : bus.readDiscreteInputs(address, count))).valuesAsArray,
      Number,
    ).slice(0, count),
  float: async (address, order) => [toFloat((await readWords(3, address, 2)).valuesAsBuffer, order)],
  float_write: async (address, value, order) =>
    void (await bus.writeMultipleRegisters(address, fromFloat(value, order))),
  word_write: async (address, value) => void (await bus.writeSingleRegister(address, value)),
  words_write: async (address, ...values) => void (await bus.writeMultipleRegisters(address, values)),
  coil_write: async (address, value) => void (await bus.writeSingleCoil(address, Boolean(value))),
  coils_write: async (address, ...values) => void (await bus.writeMultipleCoils(address, values.map(Boolean))),
  identity: async (code, object) =>
    (await body(bus.readDeviceIdentification(code, object))).objects.map(({ id, value }) => [String(id), String(value)]),
  together: (count) => together(count, async (address) => (await readWords(3, address, 1)).valuesAsArray[0]),
};

stream.on(openEvent, () =>
  carryOut(requests, (error) => error.response?.body?.code).then(() => (transport === "tcp" ? stream.end() : stream.close())),
);
