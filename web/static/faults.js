// Lists of the active faults and status bits, with their meanings and the required actions.

import { byId, create, setText, withCode } from "./elements.js";
import { formatName } from "./format.js";

/** Status bits that need attention even without a fault. The first three are signals of NAMUR NE 107. */
const ATTENTION_BITS = ["failure", "out_of_specification", "maintenance_required", "baseline_old"];

let shownFaults = "";
let shownStatus = "";

/** Show the faults and the status bits of a state; a state of null shows no faults. */
export function showFaults(state, info) {
  const faults = state?.faults ?? [];
  const [previousFaults, previousStatus] = [shownFaults, shownStatus];
  shownFaults = JSON.stringify([faults, info.faults]);
  shownStatus = JSON.stringify([state?.status ?? null, info.status]);
  if (shownFaults !== previousFaults) listFaults(faults, info);
  if (shownStatus !== previousStatus) listStatus(state?.status, info);
}

/** Return the status bits of a state that need attention. */
export const attentionBits = (state) => ATTENTION_BITS.filter((name) => state?.status.includes(name));

/** Return the name of a fault as words. */
export const faultName = (code, info) => formatName(info.faults[code]?.name ?? `fault ${code}`);

function listFaults(faults, info) {
  byId("faults").hidden = faults.length === 0;
  setText(byId("faults-title"), faults.length === 1 ? "1 fault" : `${faults.length} faults`);
  byId("faults-list").replaceChildren(...faults.map((code) => faultItem(code, info)));
}

function faultItem(code, info) {
  const { meaning = "", action = "" } = info.faults[code] ?? {};
  const title = create("h3", "", `${faultName(code, info)} `, create("span", "code", `fault ${code}`));
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

function listStatus(names, info) {
  const known = (names ?? [])
    .filter((name) => name in info.status)
    .map((name) => ({ name, ...info.status[name] }));
  const items = known.sort((a, b) => a.bit - b.bit).map(statusItem);
  byId("status-bits").replaceChildren(...(names ? items : [create("li", "muted", "not available")]));
}

function statusItem({ name, bit, meaning = "", action = "" }) {
  const title = create("strong", "", formatName(name));
  const number = create("span", "code", bit === undefined ? "" : `bit ${bit}`);
  const actions = action ? [create("p", "action", ...withCode(action))] : [];
  return create("li", "", title, " ", number, create("p", "", ...withCode(meaning)), ...actions);
}
