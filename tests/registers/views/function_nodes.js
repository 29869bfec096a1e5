// Runs the function nodes of a flow in virtual time. Reads one request per line: the name of a node and a
// message, or "restart". Prints the outputs of the node as one line of JSON.
const fs = require("fs");
const readline = require("readline");

const flow = JSON.parse(fs.readFileSync(process.argv[2], "utf8"));
let nodes;

function start() {
    nodes = {};
    for (const { type, name, initialize, func } of flow.filter(({ type }) => type === "function")) {
        const values = new Map();
        const context = { get: (key) => values.get(key), set: (key, value) => values.set(key, value) };
        const node = { status: () => {} };
        new Function("context", initialize)(context);
        const run = new Function("msg", "context", "node", func);
        nodes[name] = (msg) => run(msg, context, node);
    }
}

start();
readline.createInterface({ input: process.stdin }).on("line", (line) => {
    const request = JSON.parse(line);
    if (request === "restart") {
        start();
        console.log("null");
    } else {
        console.log(JSON.stringify(nodes[request.node](request.msg) || null));
    }
});
