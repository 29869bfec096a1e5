// Registers and frames as they are on the wire, while somebody looks.

import { byId, say, showRows } from "./elements.js";
import { NOT_AVAILABLE, shown, spoken } from "./numbers.js";
import { decoded, wordsOf } from "./registers.js";

const PERIOD_MS = 500;

let about = { registers: [], frames: [] };
let words = new Map();
let frames = [];
let filter = "";
let polling = false;

/** Poll while the inspector is open and the page in view. */
export function startInspector() {
  byId("filter").addEventListener("input", ({ target }) => {
    filter = target.value.trim().toLowerCase();
    draw();
  });
  byId("inspector").addEventListener("toggle", () => polling || poll());
}

/** What the registers are called. */
export function describeRegisters(newAbout) {
  about = newAbout;
}

async function poll() {
  polling = byId("inspector").open;
  if (!polling) return;
  if (!document.hidden) await ask();
  setTimeout(poll, PERIOD_MS);
}

async function ask() {
  try {
    const [registers, seen] = await Promise.all(["/api/registers", "/api/frames"].map(read));
    words = wordsOf(registers.blocks);
    frames = seen.frames;
    say(byId("inspector-said"), "");
  } catch {
    words = new Map();
    frames = [];
    say(byId("inspector-said"), "Not available: no answer from the instrument.");
  }
  draw();
}

async function read(path) {
  const response = await fetch(path, { signal: AbortSignal.timeout(3000) });
  if (!response.ok) throw new Error(String(response.status));
  return response.json();
}

function draw() {
  const wanted = (...texts) => texts.some((text) => String(text).toLowerCase().includes(filter));
  const registers = about.registers.filter((r) => wanted(r.address, r.name, spoken(r.name), r.unit, r.doc));
  showRows(byId("registers"), registers.map(registerCells), 2);
  showRows(
    byId("frames"),
    frames.filter((f) => wanted(hex3(f.id), f.name, ...Object.keys(f.values ?? {}))).map(frameCells),
    2,
  );
}

function registerCells(register) {
  const { hex, value } = decoded(register, words);
  const unit = (register.unit ?? "") + (register.writable ? " (writable)" : "");
  return [String(register.address), hex, spoken(register.name), value, unit, register.doc];
}

const hex3 = (id) => `${id.toString(16).toUpperCase()}h`;

const frameCells = (frame) => [
  hex3(frame.id),
  frame.data.toUpperCase(),
  `${spoken(frame.name)} ${frame.out ? "(sent)" : "(received)"}`,
  Object.entries(frame.values ?? {})
    .map(([name, value]) => `${spoken(name)} ${valueText(value)}`)
    .join(" · "),
  String(frame.count),
  shown(frame.age_s, 1),
];

const valueText = (value) => {
  if (value === null) return NOT_AVAILABLE;
  if (Array.isArray(value)) return value.map(spoken).join(", ") || "none";
  return typeof value === "number" ? String(Number(value.toPrecision(6))).replace("-", "−") : spoken(value);
};
