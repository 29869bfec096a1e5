// Controls: setpoint, alarm limit, hold, clear faults, zero and new balloon. The requests and rules are the same as for a PLC.

import { Arming } from "./arming.js";
import { askConfirmation, cancelConfirmation, startConfirmation } from "./confirm.js";
import { byId, setText, showFieldError, showText } from "./elements.js";
import { formatDuration, formatName, formatNumber, formatTime } from "./format.js";
import { isOutside, rangeText } from "./no-force.js";
import { blockedBy } from "./permissions.js";
import { balloonQuestion, inflateQuestion, isOutdated, isVentedSince, moveQuestion } from "./questions.js";
import { post } from "./requests.js";
import { tubeText } from "./state-bar.js";

const COMMAND_KEY = 0x5046;
const MAX_WORD = 0xffff; // of the sequence number, and of the number of a balloon
const COMMAND_TIMEOUT_MS = 10000;
const STATE_DELAY_S = 1; // time until the state shows the effect of an accepted request
/** Advice after a command. The sensor does not see a balloon behind a blocked tube. */
const ADVICE = { clear_faults: " Look at the balloon before you inflate it." };
const VENTED_BY_OTHER = "Another client has requested a vent: the question was closed.";
const ACTIONS = ["setpoint", "limit", "hold", "clear", "zero", "balloon"];

/** Panel of controls. `getModel()` returns the current link, info, session and state. */
export class Controls {
  #getModel;
  #arming = new Arming();
  #question = null; // the open confirmation dialog: action, the values that it shows, and the last vent
  #ownVent_s = 0; // time of the last accepted vent of this page
  #command = null; // the command that waits for an answer
  #result = null; // the message about the last request

  constructor(getModel) {
    this.#getModel = () => ({ ...getModel(), arming: this.#arming });
    startConfirmation();
    document.addEventListener("vent-accepted", ({ detail: t_s }) => {
      this.#ownVent_s = t_s;
      this.#arming.ventAccepted(this.#getModel());
    });
    const handlers = {
      setpoint: () => this.#requestSetpoint(),
      limit: () => this.#requestLimit(),
      hold: () => this.#requestHold(),
      clear: () => this.#requestCommand("clear_faults"),
      zero: () => this.#requestCommand("zero_pressure"),
      balloon: () => this.#requestNewBalloon(),
    };
    for (const [action, handler] of Object.entries(handlers))
      byId(`${action}-button`).addEventListener("click", () => {
        const blocked = blockedBy(action, this.#getModel());
        if (blocked) this.#showError(blocked.code, blocked.text);
        else handler();
      });
    for (const name of ["setpoint", "limit", "balloon"]) {
      byId(`${name}-form`).addEventListener("submit", (event) => event.preventDefault());
      byId(`${name}-input`).addEventListener("input", () => showInputError(name, ""));
    }
    byId("setpoint-input").addEventListener("input", () => this.#showRangeWarning());
  }

  /** Update the panel from the current state, and remove a question or message that is no longer valid. */
  update() {
    const model = this.#getModel();
    this.#arming.update(model);
    if (this.#question && isOutdated(this.#question, model)) {
      if (isVentedSince(this.#question, model)) this.#showResult("question_closed", VENTED_BY_OTHER);
      cancelConfirmation();
    }
    if (this.#result && isContradicted(this.#result, model)) this.#showResult("", "");
    const blocked = ACTIONS.map((action) => blockedBy(action, model));
    const texts = blocked.map((each) => each?.text);
    ACTIONS.forEach((action, index) =>
      showBlocked(action, blocked[index], texts.indexOf(texts[index]) < index),
    );
    this.#showState(model);
    this.#checkCommand(model);
  }

  #showState({ state, info }) {
    this.#showRangeWarning();
    setText(byId("balloon-in-use"), state ? `now ${state.balloon_id} (${inflationText(state)})` : "");
    setText(byId("setpoint-span"), spanText(writableSpan(info, "setpoint_requested"), "kPa"));
    setText(byId("limit-span"), spanText(writableSpan(info, "force_limit"), "N"));
    const requested = state && formatNumber(state.setpoint_requested_kpa, 2);
    setText(
      byId("setpoint-requested"),
      requested ? `Requested: ${formatName(state.mode)} (setpoint ${requested} kPa)` : "",
    );
    const isHeld = state && state.lease_holder !== "none";
    setText(
      byId("lease"),
      isHeld
        ? `Lease: ${formatName(state.lease_holder)}, ${formatDuration(state.lease_left_s)} left`
        : "",
    );
  }

  async #requestSetpoint() {
    const { info, state } = this.#getModel();
    const { low, high } = writableSpan(info, "setpoint_requested");
    const setpoint_kpa = numberIn("setpoint-input");
    if (!(setpoint_kpa >= low && setpoint_kpa <= high))
      return this.#rejectInput("setpoint", `Enter a number from ${low} to ${high} kPa.`);
    showInputError("setpoint", "");
    const question = moveQuestion(setpoint_kpa, rangeWarning(setpoint_kpa, info));
    if (state.mode === "hold" && !(await this.#confirm("setpoint", question))) return;
    if (await this.#write({ setpoint_requested: setpoint_kpa }))
      this.#showResult(
        "setpoint_accepted",
        `Setpoint ${formatNumber(setpoint_kpa, 3)} kPa accepted.`,
        (now) => isNear(now, setpoint_kpa),
      );
  }

  /** Warn of a setpoint without a force: the typed setpoint, or the requested one if none is typed. */
  #showRangeWarning() {
    const { info, state } = this.#getModel();
    const { low, high } = writableSpan(info, "setpoint_requested");
    const typed_kpa = numberIn("setpoint-input");
    const isTyped = typed_kpa >= low && typed_kpa <= high;
    const setpoint_kpa = isTyped ? typed_kpa : (state?.setpoint_requested_kpa ?? NaN);
    showText(byId("setpoint-warning"), rangeWarning(setpoint_kpa, info));
  }

  async #requestLimit() {
    const { low, high } = writableSpan(this.#getModel().info, "force_limit");
    const limit_n = numberIn("limit-input");
    if (!(limit_n >= low && limit_n <= high))
      return this.#rejectInput("limit", `Enter a number from ${low} to ${high} N.`);
    showInputError("limit", "");
    if (!(await this.#write({ force_limit: limit_n }))) return;
    this.#showResult(
      "limit_accepted",
      `Alarm limit ${formatNumber(limit_n, 2)} N accepted.`,
      (now) => Math.abs(now.force_limit_n - limit_n) < 1e-3,
    );
  }

  async #requestHold() {
    const { info, state } = this.#getModel();
    const setpoint_kpa = state.setpoint_requested_kpa;
    const warnings = [tubeText(info, state), rangeWarning(setpoint_kpa, info), unsetWarning(setpoint_kpa)];
    const question = inflateQuestion(state.balloon_id, state.pressure_kpa, setpoint_kpa, warnings.filter(Boolean).join(" "));
    if (!(await this.#confirm("hold", question))) return;
    const isAccepted = await this.#write({ setpoint_requested: setpoint_kpa, mode: "hold" });
    this.#arming.holdRequested();
    if (!isAccepted) return;
    this.#showResult(
      "inflating",
      `Inflating to ${formatNumber(setpoint_kpa, 3)} kPa.`,
      (now) => ["inflating", "settling"].includes(now.state) && isNear(now, setpoint_kpa),
    );
  }

  /** Return true if the operator confirms the action and the action is still possible then. */
  async #confirm(action, { title, text, confirmLabel }) {
    const { mode, setpoint_requested_kpa, balloon_id, vent_requested_s } = this.#getModel().state;
    const vent_s = Math.max(vent_requested_s, this.#ownVent_s);
    this.#question = { action, values: { mode, setpoint_requested_kpa, balloon_id }, vent_s };
    const isConfirmed = await askConfirmation(title, text, confirmLabel);
    const outdated = isOutdated(this.#question, this.#getModel());
    this.#question = null;
    return isConfirmed && !outdated;
  }

  async #requestNewBalloon() {
    const text = byId("balloon-input").value.trim();
    const number = /^[0-9]+$/.test(text) ? Number(text) : NaN;
    if (!(number <= MAX_WORD))
      return this.#rejectInput("balloon", `Enter a whole number from 0 to ${MAX_WORD}.`);
    showInputError("balloon", "");
    if (await this.#confirm("balloon", balloonQuestion(number))) await this.#requestCommand("new_balloon", number);
  }

  async #requestCommand(code, argument = 0) {
    const sequence = (this.#getModel().state.answer_sequence + 1) & MAX_WORD;
    const values = {
      command_key: COMMAND_KEY,
      command_code: code,
      command_argument: argument,
      command_sequence: sequence,
    };
    if (!(await this.#write(values))) return;
    this.#showResult("command_sent", `${capitalized(formatName(code))} requested …`);
    this.#command = { sequence, code, until_ms: performance.now() + COMMAND_TIMEOUT_MS };
  }

  /** Show the answer to the command when the state contains the answer, or a timeout. */
  #checkCommand({ state, info }) {
    const command = this.#command;
    if (!command || !state) return;
    const isAnswered =
      state.answer_sequence === command.sequence && ["done", "failed"].includes(state.answer_state);
    if (!isAnswered && performance.now() < command.until_ms) return;
    this.#command = null;
    const name = capitalized(formatName(command.code));
    if (!isAnswered)
      this.#showError("command_timeout", `${name}: no answer within ${COMMAND_TIMEOUT_MS / 1e3} s.`);
    else if (state.answer_state === "done")
      this.#showResult("command_done", `${name}: done.${ADVICE[command.code] ?? ""}`, holdsAfter(command.code));
    else this.#showError("command_failed", `${name} failed. ${rejectText(info, state.answer_result)}`);
  }

  /** Send a write request. Return true if the instrument accepts the request, else show the reject reason. */
  async #write(values) {
    const { info, session, state } = this.#getModel();
    const seen_s = state?.t_s; // the instrument rejects a request that arrives long after this state
    const { status, answer } = await post("/api/write", { values, seen_s });
    if (status === 401) session.expire();
    const isAccepted = status === 200 && answer.reject_reason === "none";
    if (!isAccepted)
      this.#showError("rejected", `Rejected. ${rejectSentence(info, answer)}`);
    return isAccepted;
  }

  /** Show an error beside a field, and remove the message about the last request. */
  #rejectInput(name, text) {
    showInputError(name, text);
    this.#showResult("", "");
  }

  #showError(code, text) {
    this.#showResult(code, text, ALWAYS, true);
  }

  /** Show a message with the time of day. It is removed when `holds(state)` is false for a later state. */
  #showResult(code, text, holds = ALWAYS, isError = false) {
    const box = byId("result");
    showText(box, text && `${formatTime(new Date())} ${text}`);
    box.dataset.code = code;
    box.dataset.error = isError;
    if (text) box.scrollIntoView({ block: "nearest" });
    this.#result = { holds, from_s: (this.#getModel().state?.t_s ?? 0) + STATE_DELAY_S };
  }
}

/** Return true if a message is not true any more, or if no state shows whether the message is true. */
const isContradicted = ({ holds, from_s }, { state }) =>
  state ? state.t_s > from_s && !holds(state) : holds !== ALWAYS;

const showInputError = (name, text) => showFieldError(name, text, `${name}-input`);

/** Condition of a message that stays true, because it is about an event in the past. */
const ALWAYS = () => true;

const isNear = ({ setpoint_requested_kpa }, kpa) => Math.abs(setpoint_requested_kpa - kpa) < 1e-3;

const inflationText = ({ inflation_count: count }) =>
  `${count} ${count === 1 ? "inflation" : "inflations"} since the last start`;

const rangeWarning = (setpoint_kpa, { force_range_kpa }) =>
  isOutside(setpoint_kpa, force_range_kpa) ? `No force outside ${rangeText(force_range_kpa)}.` : "";

/** Warn of a setpoint that is typed, but not set: the inflation uses the setpoint that is set. */
const unsetWarning = (setpoint_kpa) => {
  const typed_kpa = numberIn("setpoint-input");
  const isSet = Number.isNaN(typed_kpa) || Math.abs(typed_kpa - setpoint_kpa) < 1e-3;
  return isSet ? "" : `The ${formatNumber(typed_kpa, 2)} kPa in the field are not set.`;
};

/** Return the condition under which the message about a finished command is still true. */
const holdsAfter = (code) => (code === "clear_faults" ? ({ faults }) => !faults.length : ALWAYS);

/** Return a writable register of this name, with its limits `low` and `high`; {} while the data is loading. */
const writableSpan = (info, name) =>
  info.registers.find((register) => register.name === name && register.writable) ?? {};

const spanText = ({ low, high }, unit) => (low === undefined ? "" : `${low} to ${high} ${unit}`);

/** Return the number that is typed into a field; NaN if there is none. A decimal comma is allowed. */
const numberIn = (id) => Number(byId(id).value.trim().replace(",", ".") || NaN);

const rejectText = (info, reason) => info.reject_reasons[reason] ?? capitalized(formatName(reason));

const rejectSentence = (info, { text, reject_reason }) =>
  capitalized(text || rejectText(info, reject_reason));

const capitalized = (text) => text.charAt(0).toUpperCase() + text.slice(1);

/**
 * Mark the button of a blocked action, and show the reason.
 *
 * A blocked button can still have the focus, so that screen readers read the reason. A reason that is already
 * shown at another button is visually hidden.
 */
function showBlocked(action, blocked, isRepeated) {
  byId(`${action}-button`).setAttribute("aria-disabled", String(blocked !== null));
  const reason = byId(`${action}-reason`);
  showText(reason, blocked?.text ?? "");
  reason.dataset.code = blocked?.code ?? "";
  reason.classList.toggle("visually-hidden", isRepeated);
}
