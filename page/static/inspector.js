// Registers and frames as they are on the wire, while somebody looks.

import { byId, say, showRows } from "./elements.js";
import { NOT_AVAILABLE, hex, plain, shown, spoken } from "./numbers.js";
import { decoded, wordsOf } from "./registers.js";
import { get } from "./requests.js";

const PERIOD_MS = 500;

let named = [];
let words = null; // null: they could not be read
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
export function describeRegisters({ registers }) {
  named = registers;
}

async function poll() {
  polling = byId("inspector").open;
  if (!polling) return;
  if (!document.hidden) await ask();
  setTimeout(poll, PERIOD_MS);
}

async function ask() {
  try {
    const [registers, seen] = await Promise.all(["/api/registers", "/api/frames"].map(get));
    words = wordsOf(registers.blocks);
    frames = seen.frames;
  } catch {
    words = null;
    frames = [];
  }
  draw();
}

function draw() {
  const wanted = (...texts) => texts.some((text) => String(text).toLowerCase().includes(filter));
  const registers = named.filter((r) => wanted(r.address, r.name, spoken(r.name), r.unit, r.doc));
  const passing = frames.filter((f) => wanted(idText(f), f.name, ...Object.keys(f.values ?? {})));
  showRows(byId("registers"), registers.map(registerCells), 2);
  showRows(byId("frames"), passing.map(frameCells), 2);
  say(byId("inspector-said"), remark(registers.length + passing.length));
}

function remark(found) {
  if (!words) return "Not available: no answer from the instrument.";
  return found ? "" : `No register or frame has “${filter}” in its name, address, unit or meaning.`;
}

function registerCells(register) {
  const { hex: raw, value } = decoded(register, words ?? new Map());
  const unit = (register.unit ?? "") + (register.writable ? " (writable)" : "");
  return [String(register.address), raw, spoken(register.name), value, unit, register.doc];
}

const idText = ({ id }) => `${hex(id, 3)}h`;

const frameCells = (frame) => [
  idText(frame),
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
  return typeof value === "number" ? plain(value) : spoken(value);
};
