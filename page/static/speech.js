// What a screen reader says by itself: changes of state and faults, never numbers.

import { say } from "./elements.js";
import { nameOf } from "./faults.js";
import { shown, spoken } from "./numbers.js";

const PAUSE_MS = 700; // a change of state comes with its faults: they are said together

/** Speaks through a polite live region. */
export class Speech {
  #region;
  #before = null;
  #pending = [];
  #timer = 0;

  constructor(region) {
    this.#region = region;
  }

  /** Say what differs from the state before; null is no state. */
  hear(state, about) {
    const before = this.#before;
    this.#before = state;
    if (!state) return;
    if (state.state !== before?.state) this.#say(stateWords(state));
    for (const code of state.faults)
      if (!before?.faults.includes(code))
        this.#say(`Fault: ${nameOf(code, about)}. ${about.faults[code]?.what ?? ""}`);
    if (before?.faults.length && !state.faults.length) this.#say("Faults cleared.");
  }

  #say(sentence) {
    this.#pending.push(sentence);
    this.#timer ||= setTimeout(() => {
      say(this.#region, this.#pending.join(" "));
      this.#pending = [];
      this.#timer = 0;
    }, PAUSE_MS);
  }
}

const stateWords = ({ state, setpoint_kpa }) =>
  setpoint_kpa === null || setpoint_kpa === undefined
    ? `State: ${spoken(state)}.`
    : `State: ${spoken(state)}, setpoint ${shown(setpoint_kpa, 2)} kilopascals.`;
