// What a screen reader says by itself: changes of state, faults, what wants to be done; never measurements.

import { say } from "./elements.js";
import { nameOf, wantingOf } from "./faults.js";
import { shown, spoken } from "./numbers.js";

const PAUSE_MS = 700; // a trip comes with its faults: they are said together; of states that pass, the last

/** Speaks through two live regions: a trip at once, all else when the reader has a pause. */
export class Speech {
  #polite;
  #alarms;
  #before = null;

  constructor(politeRegion, alarmRegion) {
    this.#polite = new Voice(politeRegion);
    this.#alarms = new Voice(alarmRegion);
  }

  /** Say what differs from the state before; null is no state. */
  hear(state, about) {
    const before = this.#before;
    this.#before = state;
    if (!state) return;
    const tripped = state.state === "tripped";
    if (state.state !== before?.state) (tripped ? this.#alarms : this.#polite).say("state", stateWords(state));
    for (const code of added(state.faults, before?.faults))
      this.#alarms.say(code, `Fault: ${nameOf(code, about)}. ${about.faults[code]?.what ?? ""}`);
    if (before?.faults.length && !state.faults.length) this.#polite.say("cleared", "Faults cleared.");
    for (const name of tripped ? [] : added(wantingOf(state), wantingOf(before)))
      this.#polite.say(name, `Status: ${spoken(name)}. ${about.status[name]?.do ?? ""}`);
  }
}

/** One region: what comes within a pause is said at its end, of each subject the latest. */
class Voice {
  #region;
  #pending = new Map();
  #timer = 0;

  constructor(region) {
    this.#region = region;
  }

  say(subject, sentence) {
    this.#pending.set(subject, sentence);
    this.#timer ||= setTimeout(() => {
      say(this.#region, [...this.#pending.values()].join(" "));
      this.#pending.clear();
      this.#timer = 0;
    }, PAUSE_MS);
  }
}

const added = (now, before = []) => now.filter((one) => !before.includes(one));

const stateWords = ({ state, setpoint_kpa }) =>
  setpoint_kpa === null || setpoint_kpa === undefined
    ? `State: ${spoken(state)}.`
    : `State: ${spoken(state)}, setpoint ${shown(setpoint_kpa, 2)} kilopascals.`;
