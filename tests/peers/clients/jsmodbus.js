// npm's jsmodbus as a client: node jsmodbus.js tcp PORT, or rtu DEVICE
const net = require("net");
const modbus = require("jsmodbus");
const { carryOut, toFloat, fromFloat, together } = require("./lines.js");

const [wire, where] = process.argv.slice(2);

const onTcp = () => {
  const stream = net.connect(Number(where), "127.0.0.1");
  return [stream, new modbus.client.TCP(stream, 1), "connect"];
};
const onLine = () => {
  const { SerialPort } = require("serialport");
  const stream = new SerialPort({ path: where, baudRate: 19200, parity: "none", stopBits: 2 });
  return [stream, new modbus.client.RTU(stream, 1), "open"];
};
const [stream, bus, begins] = wire === "tcp" ? onTcp() : onLine();

const body = async (asked) => (await asked).response.body;
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
  put_float: async (address, value, order) =>
    void (await bus.writeMultipleRegisters(address, fromFloat(value, order))),
  word: async (address, value) => void (await bus.writeSingleRegister(address, value)),
  put: async (address, ...values) => void (await bus.writeMultipleRegisters(address, values)),
  coil: async (address, value) => void (await bus.writeSingleCoil(address, Boolean(value))),
  coils: async (address, ...values) => void (await bus.writeMultipleCoils(address, values.map(Boolean))),
  identity: async (code, object) =>
    (await body(bus.readDeviceIdentification(code, object))).objects.map(({ id, value }) => [String(id), String(value)]),
  together: (count) => together(count, async (address) => (await readWords(3, address, 1)).valuesAsArray[0]),
};

stream.on(begins, () =>
  carryOut(requests, (error) => error.response?.body?.code).then(() => (wire === "tcp" ? stream.end() : stream.close())),
);
