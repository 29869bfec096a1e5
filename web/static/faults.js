// Lists of the active faults and status bits, with their meanings and the required actions.

import { byId, create, setText, withCode } from "./elements.js";
import { formatDuration, formatName, formatNumber } from "./format.js";

/** Status bits that need attention even without a fault. The first three are signals of NAMUR NE 107. */
const ATTENTION_BITS = ["failure", "out_of_specification", "maintenance_required", "baseline_old"];

let shownFaults = "";
let shownStatus = "";

/** Show the faults, the status bits and the proof test of a state; a state of null shows no faults. */
export function showFaults(state, info) {
  setText(byId("proof-test"), state ? proofTestText(state.proof_test_age_s) : "");
  const faults = state?.faults ?? [];
  const [previousFaults, previousStatus] = [shownFaults, shownStatus];
  shownFaults = JSON.stringify([faults, info.faults]);
  const limit = formatNumber(state?.force_lower_range_limit_n, 2);
  shownStatus = JSON.stringify([
    state?.status ?? null,
    state?.maintenance_causes ?? null,
    info.status,
    limit,
    faults.length,
  ]);
  if (shownFaults !== previousFaults) listFaults(faults, info);
  if (shownStatus !== previousStatus) listStatus(state, info);
}

/** Return the status bits of a state that need attention. */
export const attentionBits = (state) => ATTENTION_BITS.filter((name) => state?.status.includes(name));

/** Return the name of a fault in words. */
export const faultTitle = (code, info) => info.faults[code]?.title ?? `fault ${code}`;

function listFaults(faults, info) {
  byId("faults").hidden = faults.length === 0;
  setText(byId("faults-title"), faults.length === 1 ? "1 fault" : `${faults.length} faults`);
  byId("faults-list").replaceChildren(...faults.map((code) => faultItem(code, info)));
}

/** Return the time since the last proof test of the tube as text. The age is not a number before a setpoint. */
const proofTestText = (age_s) =>
  Number.isFinite(age_s)
    ? `Proof test of the tube passed, or setpoint changed, ${formatDuration(age_s)} ago.`
    : "No proof test of the tube: the balloon is not inflated.";

function faultItem(code, info) {
  const { meaning = "", action = "" } = info.faults[code] ?? {};
  const title = create("h3", "", `${faultTitle(code, info)} `, codeText(`fault ${code}`));
  const item = create(
    "li",
    "",
    title,
    create("p", "", ...withCode(meaning)),
    create("p", "action", ...withCode(action)),
  );
  item.dataset.fault = info.faults[code]?.name ?? "";
  return item;
}

/** List the status bits that ask something of an operator, and all others in the details. */
function listStatus(state, info) {
  const known = (state?.status ?? [])
    .filter((name) => name in info.status)
    .map((name) => ({ name, ...info.status[name] }))
    .sort((a, b) => a.bit - b.bit);
  const asking = known.filter(({ action }) => action).map((bit) => askingItem(withCauses(bit, state, info), state));
  const others = known.filter(({ action }) => !action);
  if (!asking.length) asking.push(create("li", "muted", nothingText(state)));
  byId("status-bits").replaceChildren(...asking);
  byId("other-status-bits").replaceChildren(...others.map(otherItem));
}

/** Return a status bit whose action names the causes of the required maintenance. */
function withCauses(bit, state, info) {
  if (bit.name !== "maintenance_required") return bit;
  const causes = (state.maintenance_causes ?? []).map((name) => info.maintenance[name] ?? formatName(name));
  return { ...bit, action: [bit.action, ...causes].join(" ") };
}

function nothingText(state) {
  if (!state) return "not available";
  return state.faults.length ? "See the list of faults." : "Nothing to do.";
}

function askingItem({ name, bit, action }, state) {
  const text = create("p", "action", fillIn(action, state));
  return create("li", "", create("strong", "", formatName(name)), " ", codeText(`bit ${bit}`), text);
}

function otherItem({ name, bit, meaning }) {
  const text = create("p", "", ...withCode(meaning));
  return create("li", "", create("strong", "", formatName(name)), " ", codeText(`bit ${bit}`), text);
}

/** Return a text in which the values of the state replace {quantity}. */
export const fillIn = (text, state) => text.replace(/\{(\w+)\}/g, (_, name) => formatNumber(state[name], 2));

/** Return a number of a fault or bit, which screen readers skip, because the name is beside it. */
function codeText(text) {
  const code = create("span", "code", text);
  code.setAttribute("aria-hidden", "true");
  return code;
}
