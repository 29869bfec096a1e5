// Modbus words and what they mean: pure, for the inspector.

import { NOT_AVAILABLE, hex, plain, spoken } from "./numbers.js";

const TEST_ADDRESS = 3840; // holds −123.45, whose high word is C2F6h: this settles the order of words
const HIGH_WORD = 0xc2f6;
const NOT_AVAILABLE_CODE = { int16: 0x7fff, uint16: 0xffff };

/** A map of address → word, of blocks {address, words}. */
export function wordsOf(blocks) {
  const words = new Map();
  for (const { address, words: block } of blocks) block.forEach((word, at) => words.set(address + at, word));
  return words;
}

/** Raw words in hex, value in words, of one register; "–" for words that were not read. */
export function decoded(register, words) {
  const raw = Array.from({ length: register.words }, (_, at) => words.get(register.address + at));
  if (raw.includes(undefined)) return { hex: NOT_AVAILABLE, value: NOT_AVAILABLE };
  const swapped = words.get(TEST_ADDRESS) !== HIGH_WORD;
  const value = valueText(register, swapped ? raw.toReversed() : raw);
  return { hex: raw.map((word) => hex(word, 4)).join(" "), value };
}

function valueText({ type, unit, always, codes = {}, bits = {} }, [high, low]) {
  const number = numberOf(type, high, low);
  if (unit && !always && high === NOT_AVAILABLE_CODE[type]) return NOT_AVAILABLE;
  if (Object.keys(bits).length) return bitNames(bits, number) || "none";
  if (codes[number] !== undefined) return `${number} ${spoken(codes[number])}`;
  return type === "float32" ? plain(number) : String(number).replace("-", "−");
}

function numberOf(type, high, low = 0) {
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
    .map(([, name]) => spoken(name))
    .join(", ");
