// Inspector: Modbus registers and CAN frames with their raw data. Polls only while the inspector is open.

import { byId, setText, showRows } from "./elements.js";
import { NOT_AVAILABLE, formatFloat, formatHex, formatName, formatNumber } from "./format.js";
import { decodeRegister, wordMap } from "./registers.js";
import { get } from "./requests.js";

const PERIOD_MS = 500;

let allRegisters = [];
let words = null; // null if the last request failed
let frames = [];
let filter = "";
let isPolling = false;

/** Connect the filter, and poll while the inspector is open and the page is visible. */
export function startInspector() {
  byId("filter").addEventListener("input", ({ target }) => {
    filter = target.value.trim().toLowerCase();
    draw();
  });
  byId("inspector").addEventListener("toggle", () => isPolling || poll());
}

/** Set the descriptions of the registers. */
export function setRegisters({ registers }) {
  allRegisters = registers;
}

async function poll() {
  isPolling = byId("inspector").open;
  if (!isPolling) return;
  if (!document.hidden) await load();
  setTimeout(poll, PERIOD_MS);
}

async function load() {
  try {
    const [registers, can] = await Promise.all(["/api/registers", "/api/frames"].map((path) => get(path)));
    words = wordMap(registers.blocks);
    frames = can.frames;
  } catch {
    words = null;
    frames = [];
  }
  draw();
}

function draw() {
  const matches = (...texts) => texts.some((text) => String(text).toLowerCase().includes(filter));
  const registers = allRegisters.filter((r) => matches(r.address, r.name, formatName(r.name), r.unit, r.doc));
  const matchingFrames = frames.filter((f) => matches(formatId(f), f.name, ...Object.keys(f.values ?? {})));
  showRows(byId("registers"), registers.map(registerCells), 2);
  showRows(byId("frames"), matchingFrames.map(frameCells), 2);
  setText(byId("inspector-message"), message(registers.length + matchingFrames.length));
}

function message(count) {
  if (!words) return "Not available: the instrument does not answer.";
  return count ? "" : `No register or frame contains “${filter}”.`;
}

function registerCells(register) {
  const { hex, value } = decodeRegister(register, words ?? new Map());
  const unit = (register.unit ?? "") + (register.writable ? " (writable)" : "");
  return [String(register.address), hex, formatName(register.name), value, unit, register.doc];
}

const formatId = ({ id }) => `${formatHex(id, 3)}h`;

const frameCells = (frame) => [
  formatId(frame),
  frame.data.toUpperCase(),
  `${formatName(frame.name)} ${frame.out ? "(sent)" : "(received)"}`,
  Object.entries(frame.values ?? {})
    .map(([name, value]) => `${formatName(name)} ${formatField(value)}`)
    .join(" · "),
  String(frame.count),
  formatNumber(frame.age_s, 1),
];

const formatField = (value) => {
  if (value === null) return NOT_AVAILABLE;
  if (Array.isArray(value)) return value.map(formatName).join(", ") || "none";
  return typeof value === "number" ? formatFloat(value) : formatName(value);
};
