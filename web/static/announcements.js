// Announcements for screen readers: changes of the state, faults, and status bits that need attention.
// Measured values are not announced.

import { setText } from "./elements.js";
import { attentionBits, faultTitle, fillIn } from "./faults.js";
import { formatName, formatNumber } from "./format.js";
import { UNKNOWN_INFO } from "./requests.js";

/** Delay that joins related changes in one announcement, for example a trip and its faults. */
const DELAY_MS = 700;
/** Time after which a sentence is removed, so that a screen reader does not find old sentences. */
const KEEP_MS = 10000;

/** Announcer with two live regions: trips and faults interrupt the screen reader, other changes do not. */
export class Announcer {
  #polite;
  #alarms;
  #previous = null;

  constructor(politeRegion, alarmRegion, keep_ms = KEEP_MS) {
    this.#polite = new LiveRegion(politeRegion, keep_ms);
    this.#alarms = new LiveRegion(alarmRegion, keep_ms);
  }

  /**
   * Announce the differences from the previous state. Without a state (null), remove all sentences, because they
   * are about an old state.
   *
   * Faults have no names until the facts about the instrument are loaded.
   */
  update(state, info) {
    if (info === UNKNOWN_INFO) return;
    const previous = this.#previous;
    this.#previous = state;
    if (!state) {
      if (previous) for (const region of [this.#polite, this.#alarms]) region.clear();
      return;
    }
    const isTripped = state.state === "tripped";
    if (state.state !== previous?.state)
      (isTripped ? this.#alarms : this.#polite).announce("state", stateSentence(state));
    for (const code of added(state.faults, previous?.faults))
      this.#alarms.announce(code, `Fault: ${faultTitle(code, info)}. ${info.faults[code]?.meaning ?? ""}`);
    if (previous?.faults.length && !state.faults.length) this.#polite.announce("cleared", "Faults cleared.");
    for (const name of isTripped ? [] : added(attentionBits(state), attentionBits(previous))) {
      const action = fillIn(info.status[name]?.action ?? "", state);
      this.#polite.announce(name, `Status: ${formatName(name)}. ${action}`);
    }
  }
}

/** ARIA live region that collects the latest sentence of each subject for `DELAY_MS`, and later empties itself. */
class LiveRegion {
  #element;
  #pending = new Map();
  #timer = 0;
  #keep_ms;
  #emptyTimer = 0;

  constructor(element, keep_ms) {
    this.#element = element;
    this.#keep_ms = keep_ms;
  }

  announce(subject, sentence) {
    this.#pending.set(subject, sentence);
    this.#timer ||= setTimeout(() => this.#show(), DELAY_MS);
  }

  clear() {
    this.#pending.clear();
    setText(this.#element, "");
  }

  #show() {
    setText(this.#element, [...this.#pending.values()].join(" "));
    this.#pending.clear();
    this.#timer = 0;
    clearTimeout(this.#emptyTimer);
    this.#emptyTimer = setTimeout(() => setText(this.#element, ""), this.#keep_ms);
  }
}

const added = (current, previous = []) => current.filter((item) => !previous.includes(item));

const stateSentence = ({ state, setpoint_kpa }) =>
  setpoint_kpa === null || setpoint_kpa === undefined
    ? `State: ${formatName(state)}.`
    : `State: ${formatName(state)}, setpoint ${formatNumber(setpoint_kpa, 2)} kilopascals.`;
