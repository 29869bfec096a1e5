// Server of jsmodbus with 200 registers, coils and inputs each: node stock_jsmodbus.js PORT
const { createServer } = require("net");
const modbus = require("jsmodbus");

const SIZE = 200;
const netServer = createServer();
netServer.on("connection", (socket) => socket.on("error", () => {}));
new modbus.server.TCP(netServer, {
  coils: Buffer.alloc(SIZE / 8),
  discrete: Buffer.alloc(SIZE / 8),
  holding: Buffer.alloc(2 * SIZE),
  input: Buffer.alloc(2 * SIZE),
});
netServer.listen(Number(process.argv[2]), "127.0.0.1");
