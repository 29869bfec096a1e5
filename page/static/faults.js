// Faults and status bits in plain words, with what to do.

import { byId, make, say, worded } from "./elements.js";
import { spoken } from "./numbers.js";

/** Status bits that want something done though nothing may have tripped (three of them are NAMUR NE 107's). */
const WANTING = ["failure", "out_of_specification", "maintenance", "baseline_old"];

let shownFaults = "";
let shownStatus = "";

/** The list of faults, and the status in words; null shows neither. */
export function showFaults(state, about) {
  const faults = state?.faults ?? [];
  const [wasFaults, wasStatus] = [shownFaults, shownStatus];
  shownFaults = JSON.stringify([faults, about.faults]);
  shownStatus = JSON.stringify([state?.status ?? null, about.status]);
  if (shownFaults !== wasFaults) listFaults(faults, about);
  if (shownStatus !== wasStatus) listStatus(state?.status, about);
}

/** Those of a state's bits that want something done. */
export const wantingOf = (state) => WANTING.filter((name) => state?.status.includes(name));

/** What a fault is called, for people. */
export const nameOf = (code, about) => spoken(about.faults[code]?.name ?? `fault ${code}`);

function listFaults(faults, about) {
  byId("faults").hidden = faults.length === 0;
  say(byId("faults-title"), faults.length === 1 ? "1 fault" : `${faults.length} faults`);
  byId("faults-list").replaceChildren(...faults.map((code) => faultItem(code, about)));
}

function faultItem(code, about) {
  const { what = "", do: remedy = "" } = about.faults[code] ?? {};
  const name = make("h3", "", `${nameOf(code, about)} `, make("span", "code", `fault ${code}`));
  return make("li", "", name, make("p", "", ...worded(what)), make("p", "remedy", ...worded(remedy)));
}

function listStatus(names, about) {
  const known = (names ?? [])
    .filter((name) => name in about.status)
    .map((name) => ({ name, ...about.status[name] }));
  const items = known.sort((a, b) => a.bit - b.bit).map(statusItem);
  byId("conditions").replaceChildren(...(names ? items : [make("li", "quiet", "not available")]));
}

function statusItem({ name, bit, what = "", do: remedy = "" }) {
  const title = make("strong", "", spoken(name));
  const number = make("span", "code", bit === undefined ? "" : `bit ${bit}`);
  const advice = remedy ? [make("p", "remedy", ...worded(remedy))] : [];
  return make("li", "", title, " ", number, make("p", "", ...worded(what)), ...advice);
}
