// Holds the balloon at a setpoint, renews the lease, and clears faults. One write is sent at a time.
// Input: commands (topic "hold", "setpoint", "force_limit", "clear", "vent"), readings, notes of the node
// "Vent", topic "tick" every 250 ms, and the answers of the Modbus node.
// Output 1: requests for the Modbus node. Output 2: a request to the node "Vent". Output 3: notes.
const tables = context.get("tables");
const state = context.get("state");
const outputs = { writes: [], vent: null, notes: [] };

const handlers = {
    hold: onHold,
    vent: onVent,
    setpoint: () => onValue("setpoint"),
    force_limit: () => onValue("force_limit"),
    clear: onClear,
    tick: onTick,
    reading: onReading,
    "vent note": () => { state.venting = !msg.accepted; },
};
const handler = handlers[msg.topic];
if (handler) {
    handler();
} else if (state.pending && msg.topic === `${state.pending.name} ${state.request}`) {
    onAnswer();
}
sendDueWrites();
node.status({ fill: state.step === "holding" ? "green" : "grey", shape: "dot", text: state.step });
context.set("state", state);
return [outputs.writes, outputs.vent, outputs.notes];

// ---- commands

function onHold() {
    const reading = state.reading;
    if (state.step !== "idle") {
        return note(`The hold was not started: the step "${state.step}" is not finished. Vent first.`);
    }
    if (state.venting) {
        return note("The hold was not started: the instrument has not accepted the vent yet.");
    }
    if (!reading || !reading.connected || state.readingTicks >= tables.renewTicks) {
        const problem = (reading && reading.explanation) || "There is no reading.";
        return note(`The hold was not started. ${problem}`);
    }
    if (reading.fault) {
        return note(`The hold was not started: ${faultText(reading.fault)}`);
    }
    enter("lease");
    write("lease", 6, tables.address.lease, [tables.leaseMs]);
}

// The node "Vent" gets the same command.
function onVent() {
    state.venting = true;
    stop();
}

function onValue(name) {
    const { low, high, unit } = tables.limits[name];
    const value = Number(msg.payload);
    if (!(low <= value && value <= high)) { // false for NaN, too
        return note(`${name} ${msg.payload} was not sent: it must be ${low} to ${high} ${unit}.`);
    }
    state.values[name] = value;
    if (tables.leased.includes(state.step)) {
        state.due = state.due.filter((due) => due !== name).concat(name);
    }
    note(`${name} is ${value} ${unit}.`);
}

function onClear() {
    if (state.step !== "idle") {
        return note(`The faults were not cleared: the step "${state.step}" is not finished. Vent first.`);
    }
    if (!state.reading || state.reading.answer_sequence === undefined) {
        return note("The faults were not cleared: the instrument cannot be read.");
    }
    state.sequence = (state.reading.answer_sequence + 1) & 0xffff;
    enter("clear");
    write("clear", 16, tables.address.command, [tables.commandKey, tables.clearFaults, 0, state.sequence]);
}

// ---- events

function onTick() {
    state.ticks += 1;
    state.readingTicks += 1;
    state.renewTicks += 1;
    if (state.pending) {
        state.pending.ticks += 1;
        if (state.pending.ticks >= tables.answerTicks) {
            onFailure("The instrument does not answer.", false);
        }
    }
    if (state.step === "rejected" && state.ticks >= tables.stepTicks.rejected) {
        end(state.problem, state.ventAfter);
    } else if (state.ticks >= tables.stepTicks[state.step]) {
        end(`The step "${state.step}" took too long.`, state.step !== "clearing");
    }
    if (tables.leased.includes(state.step)) {
        renewLease();
    }
}

// Renew the lease only while the instrument can be read. Without renewal, the instrument vents.
function renewLease() {
    if (state.readingTicks >= tables.leaseTicks) {
        end("The instrument could not be read for the time of the lease, so the lease expires.", true);
    } else if (state.readingTicks < tables.renewTicks) {
        const renewal = state.renewTicks >= tables.renewTicks ? ["renew"] : [];
        state.due = [...new Set([...state.due, ...state.retry, ...renewal])];
        state.retry = [];
    }
}

function onReading() {
    const reading = msg.payload;
    state.reading = reading;
    if (!reading.connected || reading.state === undefined) {
        return;
    }
    state.readingTicks = 0;
    if (state.step === "rejected" && state.ticks >= tables.cycleTicks) { // read after the rejection
        end(`${state.problem} ${tables.rejectReasons[reading.reject_reason] || ""}`, state.ventAfter);
    } else if (state.step === "clearing") {
        checkClear(reading);
    } else if (tables.leased.includes(state.step)) {
        checkHold(reading);
    }
}

function checkHold(reading) {
    const missed = state.step === "inflating" && state.ticks > tables.startTicks;
    if (reading.fault) {
        end(`The rig has tripped: ${faultText(reading.fault)}`, true);
    } else if (state.step === "emptying") {
        if (reading.state === "vented" && !reading.status.includes("not_zeroed") && !state.pending) {
            requestInflation();
        }
    } else if (state.step === "inflating" && reading.state === "holding") {
        enter("holding");
        note(`The balloon is held at ${state.values.setpoint} kPa.`);
    } else if ((missed || state.step === "holding") && tables.notInflated.includes(reading.state)) {
        end(`The hold has ended: the state is ${reading.state}.`, true);
    }
}

// The instrument accepts setpoint, force limit, mode and lease together, or rejects all of them.
function requestInflation() {
    const { setpoint, force_limit: limit } = state.values;
    state.due = []; // the request contains all values, and renews the lease
    state.retry = [];
    enter("request");
    write("hold", 16, tables.address.setpoint,
        [...floatWords(setpoint), ...floatWords(limit), tables.hold, tables.leaseMs]);
}

function checkClear(reading) {
    if (reading.answer_sequence !== state.sequence || reading.answer_state < tables.done) {
        return;
    }
    const done = reading.answer_state === tables.done;
    const reason = tables.rejectReasons[reading.answer_result] || "";
    end(done ? "The faults are cleared." : `The faults were not cleared. ${reason}`, false);
}

function onAnswer() {
    if (msg.error) {
        return onFailure(`${msg.error.message}.`, /exception/i.test(msg.error.message));
    }
    state.pending = null;
    const next = { lease: "vent", vent: "emptying", request: "inflating", clear: "clearing" }[state.step];
    if (state.step === "cancel") {
        end("", true);
    } else if (next) {
        enter(next);
    }
    if (next === "vent") {
        write("vent", 6, tables.address.mode, [tables.vent]);
    }
}

// A rejected write has changed nothing: the next reading shows the reason. Without an answer, the instrument
// may have executed the write. Only a renewal and a new value are repeated, because a repetition is harmless.
function onFailure(text, rejected) {
    const { name } = state.pending;
    state.pending = null;
    if (state.step === "cancel") {
        end("", true);
    } else if (!rejected && ["renew", "setpoint", "force_limit"].includes(name)) {
        state.retry.push(name); // at a later tick, because a write without a connection fails at once
    } else {
        state.problem = `The write "${name}" failed: ${text}`;
        state.ventAfter = name !== "lease" && name !== "clear";
        stop();
        enter("rejected");
        if (!rejected) {
            end(state.problem, name !== "clear");
        }
    }
}

// ---- steps

function enter(step) {
    state.step = step;
    state.ticks = 0;
}

// A write that is under way can be executed after the vent. The step "cancel" vents again after this write.
function stop() {
    state.due = [];
    state.retry = [];
    enter(state.pending ? "cancel" : "idle");
}

function end(text, vent) {
    stop();
    if (text) {
        note(text);
    }
    if (vent) {
        state.venting = true;
        outputs.vent = { topic: "vent" };
    }
}

function sendDueWrites() {
    if (state.pending || state.due.length === 0) {
        return;
    }
    const name = state.due.shift();
    if (name === "renew") {
        state.renewTicks = 0;
        write("renew", 6, tables.address.lease, [tables.leaseMs]);
    } else {
        write(name, 16, tables.address[name], floatWords(state.values[name]));
    }
}

function write(name, fc, address, words) {
    state.request += 1;
    state.renewTicks = 0; // each accepted write renews the lease
    state.pending = { name, ticks: 0 };
    const payload = { fc, address, quantity: words.length, value: fc === 6 ? words[0] : words };
    outputs.writes.push({ topic: `${name} ${state.request}`, payload });
}

function floatWords(value) {
    const bytes = Buffer.alloc(4);
    bytes.writeFloatBE(value, 0);
    const words = [bytes.readUInt16BE(0), bytes.readUInt16BE(2)];
    return state.reading.word_order === "CDAB" ? words.reverse() : words;
}

function faultText(fault) {
    return `fault ${fault.code} (${fault.name}). ${fault.what} ${fault.remedy}`;
}

function note(text) {
    outputs.notes.push({ topic: "note", payload: text });
}
