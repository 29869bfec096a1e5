// Announcements for screen readers: changes of the state, faults, and status bits that need attention.
// Measured values are not announced.

import { create } from "./elements.js";
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
   * Announce the differences from the previous state, and withdraw the sentences about status bits that are no
   * longer set. Without a state (null), remove all sentences, because they are about an old state.
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
    for (const name of added(attentionBits(previous), attentionBits(state))) this.#polite.withdraw(name);
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

  /** Remove the sentence of a subject. Screen readers read added elements, but not removed ones. */
  withdraw(subject) {
    this.#pending.delete(subject);
    [...this.#element.children].find(({ dataset }) => dataset.subject === subject)?.remove();
  }

  clear() {
    this.#pending.clear();
    this.#element.replaceChildren();
  }

  #show() {
    this.#timer = 0;
    if (!this.#pending.size) return;
    this.#element.replaceChildren(...[...this.#pending].map(sentenceElement));
    this.#pending.clear();
    clearTimeout(this.#emptyTimer);
    this.#emptyTimer = setTimeout(() => this.#element.replaceChildren(), this.#keep_ms);
  }
}

function sentenceElement([subject, sentence], index) {
  const element = create("span", "", index ? ` ${sentence}` : sentence);
  element.dataset.subject = subject;
  return element;
}

const added = (current, previous = []) => current.filter((item) => !previous.includes(item));

const stateSentence = ({ state, setpoint_kpa }) =>
  setpoint_kpa === null || setpoint_kpa === undefined
    ? `State: ${formatName(state)}.`
    : `State: ${formatName(state)}, setpoint ${formatNumber(setpoint_kpa, 2)} kilopascals.`;
