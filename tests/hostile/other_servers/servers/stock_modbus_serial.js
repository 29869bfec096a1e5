// Server of modbus-serial with 200 registers, coils and inputs each: node stock_modbus_serial.js PORT
const { ServerTCP } = require("modbus-serial");

const words = new Uint16Array(200);
const read = (address) => {
  if (address >= words.length) throw { modbusErrorCode: 2 };
  return words[address];
};
const write = (address, value) => {
  if (address >= words.length) throw { modbusErrorCode: 2 };
  words[address] = value;
};
const vector = {
  getCoil: (address) => Boolean(read(address)),
  getDiscreteInput: (address) => Boolean(read(address)),
  getHoldingRegister: read,
  getInputRegister: read,
  setCoil: (address, value) => write(address, Number(value)),
  setRegister: write,
};
new ServerTCP(vector, { host: "127.0.0.1", port: Number(process.argv[2]), unitID: 1 }).on("socketError", () => {});
