// Decoding of Modbus words for the inspector.

import { NOT_AVAILABLE, formatFloat, formatHex, formatName } from "./format.js";

const TEST_ADDRESS = 3840; // of the test value −123.45, whose high word shows the word order
const TEST_HIGH_WORD = 0xc2f6;
const NOT_AVAILABLE_CODE = { int16: 0x7fff, uint16: 0xffff };

/** Return a map from address to word for blocks {address, words}. */
export function wordMap(blocks) {
  const words = new Map();
  for (const { address, words: block } of blocks)
    block.forEach((word, index) => words.set(address + index, word));
  return words;
}

/** Return the words of a register as {hex, value}, both as text; "–" if a word is missing. */
export function decodeRegister(register, words) {
  const raw = Array.from({ length: register.words }, (_, index) => words.get(register.address + index));
  if (raw.includes(undefined)) return { hex: NOT_AVAILABLE, value: NOT_AVAILABLE };
  const isSwapped = words.get(TEST_ADDRESS) !== TEST_HIGH_WORD;
  const value = formatValue(register, isSwapped ? raw.toReversed() : raw);
  return { hex: raw.map((word) => formatHex(word, 4)).join(" "), value };
}

function formatValue({ type, unit, always_available, codes = {}, bits = {} }, [high, low]) {
  const number = toNumber(type, high, low);
  if (unit && !always_available && high === NOT_AVAILABLE_CODE[type]) return NOT_AVAILABLE;
  if (Object.keys(bits).length) return bitNames(bits, number) || "none";
  if (codes[number] !== undefined) return `${number} ${formatName(codes[number])}`;
  return type === "float32" ? formatFloat(number) : String(number).replace("-", "−");
}

function toNumber(type, high, low = 0) {
  const view = new DataView(new ArrayBuffer(4));
  view.setUint16(0, high);
  view.setUint16(2, low);
  const readers = {
    float32: () => view.getFloat32(0),
    uint32: () => view.getUint32(0),
    int16: () => view.getInt16(0),
    uint16: () => high,
  };
  return readers[type]();
}

const bitNames = (bits, word) =>
  Object.entries(bits)
    .filter(([bit]) => (word >>> bit) & 1)
    .map(([, name]) => formatName(name))
    .join(", ");
