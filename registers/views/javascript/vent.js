// Vents: writes mode 0 until the instrument has accepted it, then ends the lease.
// A vent needs no valid reading, no word order and no lease.
// Input: topic "vent", topic "tick" every 250 ms, and the answers of the Modbus node.
// Output 1: requests for the Modbus node. Output 2: notes.
const tables = context.get("tables");
const state = context.get("state");

const messages = handle();
context.set("state", state);
return messages;

function handle() {
    if (msg.topic === "vent") {
        return [send("mode"), note("vent requested", false)];
    }
    if (msg.topic === "tick") {
        return onTick();
    }
    return msg.topic === `${state.step} ${state.request}` ? onAnswer() : null;
}

function send(step) {
    state.step = step;
    state.request += 1;
    state.ticks = 0;
    const payload = { fc: 6, address: tables.address[step], quantity: 1, value: 0 };
    return { topic: `${step} ${state.request}`, payload };
}

// Repeat a request that failed, or that was not answered. The repetition is harmless.
function onTick() {
    state.ticks += 1;
    return state.step && state.ticks >= tables.repeatTicks ? [send(state.step), null] : null;
}

function onAnswer() {
    const rejected = msg.error && /exception/i.test(msg.error.message);
    if (state.step === "mode" && msg.error) {
        return [null, note(`The vent was not accepted: ${msg.error.message}. It is repeated. If the balloon `
            + "must be empty now, press the stop switch.", false)];
    }
    if (state.step === "mode") {
        return [send("lease"), null];
    }
    if (msg.error && !rejected) {
        return null; // the next ticks repeat the request
    }
    state.step = "";
    return [null, note("The vent was accepted. The state shows when the balloon is empty.", true)];
}

function note(text, accepted) {
    node.status({ fill: accepted ? "green" : "yellow", shape: "dot", text });
    return { topic: "vent note", accepted, payload: text };
}
