// Setpoint, hold, clear faults, zero: the same requests by the same rules as a PLC's.

import { Arming } from "./arming.js";
import { confirmed, dismiss, startConfirm } from "./confirm.js";
import { announce, byId, say } from "./elements.js";
import { clock, lasting, shown, spoken } from "./numbers.js";
import { whyNot } from "./permissions.js";
import { post } from "./requests.js";

const COMMAND_KEY = 0x5046;
const LAST_SEQUENCE = 0xffff;
const COMMAND_PATIENCE_MS = 10000;
const TAKES_EFFECT_S = 1; // until the state shows what was accepted
const BUTTONS = ["setpoint", "hold", "clear", "zero"];

/** The controls; `world()` gives link, about, token and state as they are now. */
export class Controls {
  #world;
  #arming = new Arming();
  #asked = null;
  #awaited = null;
  #said = null;

  constructor(world) {
    this.#world = () => ({ ...world(), arming: this.#arming });
    startConfirm();
    document.addEventListener("vent-accepted", () => this.#arming.vented(this.#world()));
    const asks = { setpoint: () => this.#setpoint(), hold: () => this.#hold() };
    const commands = {
      clear: () => this.#command("clear_faults"),
      zero: () => this.#command("zero_pressure"),
    };
    for (const [action, ask] of Object.entries({ ...asks, ...commands }))
      byId(`${action}-button`).addEventListener("click", () => {
        const why = whyNot(action, this.#world());
        if (why) this.#tell(why, true);
        else ask();
      });
    byId("setpoint-form").addEventListener("submit", (event) => event.preventDefault());
  }

  /** Show what may be asked for; take out of a new state what it answers, and away what it contradicts. */
  update() {
    const world = this.#world();
    this.#arming.see(world);
    if (this.#asked && isVoid(this.#asked, world)) dismiss();
    if (this.#said && isContradicted(this.#said, world)) this.#tell("");
    const whys = BUTTONS.map((action) => whyNot(action, world));
    BUTTONS.forEach((action, at) => enable(action, whys[at], whys.indexOf(whys[at]) < at));
    this.#describe(world);
    this.#listen(world);
  }

  #describe({ state, about }) {
    const { low, high } = spanOf(about);
    say(byId("setpoint-span"), low === undefined ? "" : `${low} to ${high} kPa`);
    const asked = state && shown(state.setpoint_requested_kpa, 2);
    say(byId("setpoint-asked"), asked ? `Asked for: ${asked} kPa, mode ${spoken(state.mode)}` : "");
    const held = state && state.lease_holder !== "none";
    say(
      byId("lease"),
      held ? `Lease: ${spoken(state.lease_holder)}, ${lasting(state.lease_left_s)} left` : "",
    );
  }

  async #setpoint() {
    const { about, state } = this.#world();
    const { low, high } = spanOf(about);
    const wanted = Number(byId("setpoint-wanted").value.trim().replace(",", ".") || NaN);
    if (!(wanted >= low && wanted <= high))
      return this.#tell(`The setpoint must be a number from ${low} to ${high} kPa.`, true);
    if (state.mode === "hold" && !(await this.#agreed("setpoint", moving(wanted)))) return;
    if (await this.#write({ setpoint_requested: wanted }))
      this.#tell(`Setpoint ${shown(wanted, 3)} kPa accepted.`, false, (now) => isNear(now, wanted));
  }

  async #hold() {
    const { state } = this.#world();
    const wanted = state.setpoint_requested_kpa;
    if (!(await this.#agreed("hold", inflating(state.pressure_kpa, wanted)))) return;
    const accepted = await this.#write({ setpoint_requested: wanted, mode: "hold" });
    this.#arming.spend();
    if (!accepted) return;
    this.#tell(
      `Inflating to ${shown(wanted, 3)} kPa.`,
      false,
      (now) => ["inflating", "settling"].includes(now.state) && isNear(now, wanted),
    );
  }

  /** Whether the question was answered yes, and it may still be asked for then. */
  async #agreed(action, { title, text, yes }) {
    const { mode, setpoint_requested_kpa } = this.#world().state;
    this.#asked = { action, upon: { mode, setpoint_requested_kpa } };
    const isYes = await confirmed(title, text, yes);
    const voided = isVoid(this.#asked, this.#world());
    this.#asked = null;
    return isYes && !voided;
  }

  async #command(code) {
    const sequence = (this.#world().state.answer_sequence + 1) & LAST_SEQUENCE;
    const values = {
      command_key: COMMAND_KEY,
      command_code: code,
      command_argument: 0,
      command_sequence: sequence,
    };
    if (!(await this.#write(values))) return;
    this.#tell(`${sentence(spoken(code))} asked …`);
    this.#awaited = { sequence, code, until_ms: performance.now() + COMMAND_PATIENCE_MS };
  }

  #listen({ state, about }) {
    const awaited = this.#awaited;
    if (!awaited || !state) return;
    const answered =
      state.answer_sequence === awaited.sequence && ["done", "failed"].includes(state.answer_state);
    if (!answered && performance.now() < awaited.until_ms) return;
    this.#awaited = null;
    const name = sentence(spoken(awaited.code));
    if (!answered) this.#tell(`${name}: no answer yet.`, true);
    else if (state.answer_state === "done")
      this.#tell(`${name}: done.`, false, ({ faults }) => !faults.length);
    else this.#tell(`${name} failed. ${refusalWords(about, state.answer_result)}`, true);
  }

  /** Whether the instrument accepted; what it refused is said. */
  async #write(values) {
    const { about, token, state } = this.#world();
    const seen_s = state?.t_s; // an order that arrives long after what was seen is not carried out
    const { status, answer } = await post("/api/write", { token: token.value, values, seen_s });
    if (status === 401) token.reject();
    const accepted = status === 200 && answer.refusal === "none";
    if (!accepted) this.#tell(`Refused. ${answer.text || refusalWords(about, answer.refusal)}`, true);
    return accepted;
  }

  /** Say it, with the time, until a later state contradicts it. */
  #tell(text, isBad = false, holds = () => true) {
    announce(byId("answer"), text && `${clock(new Date())} ${text}`);
    byId("answer").dataset.bad = isBad;
    this.#said = { holds, from_s: (this.#world().state?.t_s ?? 0) + TAKES_EFFECT_S };
  }
}

/** Whether the question is another than the one that was asked: what it stood upon has changed. */
const isVoid = ({ action, upon }, world) =>
  whyNot(action, world) !== "" || Object.keys(upon).some((name) => world.state[name] !== upon[name]);

const isContradicted = ({ holds, from_s }, { state }) => state?.t_s > from_s && !holds(state);

const isNear = ({ setpoint_requested_kpa }, kpa) => Math.abs(setpoint_requested_kpa - kpa) < 1e-3;

const moving = (to_kpa) => ({
  title: `Move to ${shown(to_kpa, 2)} kPa?`,
  text: `The balloon is held, and goes to ${shown(to_kpa, 3)} kPa as soon as it is not in contact.`,
  yes: "Move",
});

const inflating = (from_kpa, to_kpa) => ({
  title: `Inflate to ${shown(to_kpa, 2)} kPa?`,
  text:
    `The balloon of this instrument, now at ${shown(from_kpa, 2)} kPa, will be inflated to ` +
    `${shown(to_kpa, 3)} kPa and locked. Nothing may touch it until it is held.`,
  yes: `Inflate to ${shown(to_kpa, 2)} kPa`,
});

const spanOf = (about) => about.registers.find(({ name }) => name === "setpoint_requested") ?? {};

const refusalWords = (about, name) => about.refusals[name] ?? sentence(spoken(name));

const sentence = (words) => words.charAt(0).toUpperCase() + words.slice(1);

/** A button that cannot be used stays focusable and says why; a reason that several have is seen once. */
function enable(action, why, isSaid) {
  const button = byId(`${action}-button`);
  button.setAttribute("aria-disabled", String(why !== ""));
  announce(byId(`${action}-why`), why);
  byId(`${action}-why`).classList.toggle("unseen", isSaid);
}
