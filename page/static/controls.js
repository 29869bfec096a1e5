// Setpoint, hold, clear faults, zero: the same requests by the same rules as a PLC's.

import { confirmed, dismiss, startConfirm } from "./confirm.js";
import { announce, byId, say } from "./elements.js";
import { lasting, shown, spoken } from "./numbers.js";
import { whyNot } from "./permissions.js";
import { post } from "./requests.js";

const COMMAND_KEY = 0x5046;
const LAST_SEQUENCE = 0xffff;
const COMMAND_PATIENCE_MS = 10000;
const BUTTONS = ["setpoint", "hold", "clear", "zero"];

/** The controls; `world()` gives link, about, token and state as they are now. */
export class Controls {
  #world;
  #awaited = null;

  constructor(world) {
    this.#world = world;
    startConfirm();
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

  /** Show what may be asked for, and take the answer to a command out of a new state. */
  update() {
    const world = this.#world();
    const whys = BUTTONS.map((action) => whyNot(action, world));
    BUTTONS.forEach((action, at) => enable(action, whys[at], whys.indexOf(whys[at]) < at));
    this.#describe(world);
    if (!world.link.up || world.state?.state === "tripped") dismiss();
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
      this.#tell(`Setpoint ${shown(wanted, 3)} kPa accepted.`);
  }

  async #hold() {
    const { state } = this.#world();
    const wanted = state.setpoint_requested_kpa;
    if (!(await this.#agreed("hold", inflating(state.pressure_kpa, wanted)))) return;
    if (await this.#write({ setpoint_requested: wanted, mode: "hold" }))
      this.#tell(`Inflating to ${shown(wanted, 3)} kPa.`);
  }

  /** Whether the question was answered yes, and it may still be asked for then. */
  async #agreed(action, { title, text, yes }) {
    return (await confirmed(title, text, yes)) && !whyNot(action, this.#world());
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
    else if (state.answer_state === "done") this.#tell(`${name}: done.`);
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

  #tell(text, isBad = false) {
    announce(byId("answer"), text);
    byId("answer").dataset.bad = isBad;
  }
}

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
