// One request per input line, one line of JSON per answer. The name of a request is a key of `requests`.
const { createInterface } = require("readline");

const argument = (word) => (Number.isNaN(Number(word)) ? word : Number(word));

exports.carryOut = async (requests, codeOf) => {
  for await (const line of createInterface({ input: process.stdin })) {
    const [name, ...words] = line.split(" ");
    let answer;
    try {
      answer = (await requests[name](...words.map(argument))) ?? [];
    } catch (error) {
      const code = codeOf(error);
      answer = code ? ["exception", code] : ["error", String(error.message ?? error)];
    }
    console.log(JSON.stringify(answer));
  }
};

exports.toFloat = (bytes, order) =>
  order === "ABCD" ? bytes.readFloatBE() : Buffer.from(bytes).swap16().readFloatLE();

exports.fromFloat = (value, order) => {
  const bytes = Buffer.alloc(4);
  if (order === "ABCD") bytes.writeFloatBE(Number(value));
  else bytes.writeFloatLE(Number(value)), bytes.swap16();
  return bytes;
};

// Read one register `count` times without waiting for answers. Return [number, word] in the order of the answers.
exports.together = async (count, readWord) => {
  const answers = [];
  const reads = Array.from({ length: count }, (_, i) => readWord(3840 + (i % 5)).then((word) => answers.push([i, word])));
  await Promise.all(reads);
  return answers;
};
