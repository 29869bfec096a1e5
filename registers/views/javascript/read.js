// Reads all blocks in one cycle, and publishes one reading for each cycle.
// A reading contains a value only if this cycle read it, and if it is valid. A missing value is absent.
// Input: topic "tick" every 250 ms, and the answers of the Modbus node, whose topic is the name of the block.
// Output 1: requests for the Modbus node. Output 2: the reading.
const tables = context.get("tables");
const state = context.get("state");

const messages = msg.topic === "tick" ? onTick() : onAnswer();
context.set("state", state);
return messages;

// Start the next cycle, and give up a running cycle that is too old. A count of ticks does not jump as a
// clock can.
function onTick() {
    state.ticks += 1;
    if (state.waiting.length > 0 && state.ticks < tables.maxCycleTicks) {
        return null;
    }
    const late = state.waiting.length > 0;
    state.cycle += 1;
    state.ticks = 0;
    state.words = {};
    state.waiting = Object.keys(tables.blocks);
    const requests = state.waiting.map((name) => ({
        topic: name,
        cycle: state.cycle,
        payload: { fc: 4, address: tables.blocks[name].address, quantity: tables.blocks[name].quantity },
    }));
    return [requests, late ? withoutValues("The instrument does not answer in time.") : null];
}

function onAnswer() {
    if (msg.cycle !== state.cycle || !state.waiting.includes(msg.topic)) {
        return null; // an answer of an earlier cycle is too old
    }
    if (!Array.isArray(msg.payload) || msg.payload.length !== tables.blocks[msg.topic].quantity) {
        state.waiting = [];
        const problem = msg.error ? msg.error.message : "wrong length";
        return [null, withoutValues(`The instrument cannot be read: ${problem}.`)];
    }
    state.words[msg.topic] = msg.payload;
    state.waiting = state.waiting.filter((name) => name !== msg.topic);
    return state.waiting.length > 0 ? null : [null, evaluate()];
}

// Return the reading of a complete cycle.
function evaluate() {
    const wordOrder = Object.keys(tables.testWords).find((order) =>
        tables.testWords[order].every((word, index) => word === state.words.test[index])
    );
    if (!wordOrder) {
        return withoutValues("Registers 3840 to 3844 are wrong: this is not a pneuforce instrument, or the "
            + "unit id or the byte order is wrong.");
    }
    const values = decode(wordOrder === "CDAB");
    if (values.map_version !== tables.mapVersion || values.map_hash !== tables.mapHash) {
        return withoutValues("The register map of the instrument is not that of this flow. Import the flow "
            + "that the installed version prints: pneuforce map --format node-red.");
    }
    const counter = values.sample_counter;
    const fresh = state.counter !== undefined && counter !== state.counter;
    state.counter = counter;
    const withoutSample = { connected: true, valid: false, explanation: "There is no new sample." };
    return publish(fresh ? readingOf(values, wordOrder) : withoutSample);
}

function readingOf(values, wordOrder) {
    const code = values.first_out_fault;
    const reading = {
        connected: true,
        valid: Number.isFinite(values.force_n) && !code // the fault is read after the force
            && !tables.neverValid.some((name) => values.status.includes(name)),
        word_order: wordOrder,
        explanation: "",
        ...values,
        state: tables.states[values.state] || `${values.state}?`,
        fault: code ? { code, ...(tables.faults[code] || tables.unknownFault) } : undefined,
        advice: values.status.filter((name) => tables.advice[name])
            .map((name) => `${name}: ${tables.advice[name]}`),
    };
    if (!reading.valid) {
        tables.forces.forEach((name) => delete reading[name]);
        const reasons = Object.keys(tables.noForce).filter((name) => values.status.includes(name));
        const texts = reasons.map((name) => tables.noForce[name]);
        reading.explanation = [tables.stateTexts[values.state] || "", ...texts].join(" ").trim();
    }
    return reading;
}

// Return the values of all registers by name. A value that is not available is undefined.
function decode(lowWordFirst) {
    const values = {};
    for (const register of tables.registers) {
        const words = state.words[register.block];
        const [first, second] = [words[register.index], words[register.index + 1]];
        values[register.name] = valueOf(register, lowWordFirst ? [second, first] : [first, second], first);
    }
    const isSet = ({ bit }) => (values.status >>> bit) & 1;
    values.status = tables.statusBits.filter(isSet).map(({ name }) => name);
    return values;
}

function valueOf(register, [high, low], word) {
    const bytes = Buffer.from([high >> 8, high & 255, low >> 8, low & 255]);
    if (register.type === "float32") {
        const value = bytes.readFloatBE(0);
        return Number.isFinite(value) ? value : undefined;
    }
    if (register.type === "uint32") {
        return bytes.readUInt32BE(0);
    }
    return word === register.missing ? undefined : word;
}

// Forget the sample counter, so that a value is valid only after the second complete cycle.
function withoutValues(explanation) {
    state.counter = undefined;
    return publish({ connected: false, valid: false, explanation });
}

function publish(reading) {
    const shape = reading.connected ? "dot" : "ring";
    const text = reading.valid ? `${reading.force_n.toFixed(3)} N` : `no value: ${reading.explanation}`;
    node.status({ fill: reading.valid ? "green" : "red", shape, text });
    return { topic: "reading", payload: reading };
}
